#include "common/camera_model.hpp"
#include "common/config/camera_file.hpp"
#include "common/config/config_node.hpp"
#include "common/random.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace breakshot {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kFile = BREAKSHOT_SOURCE_DIR "/config/cameras/d435i.yaml";

/// The shipped file with one text replaced, and the error that it gives.
std::string error_with(const std::string& from, const std::string& to) {
  std::ifstream stream{kFile};
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const std::filesystem::path file = std::filesystem::path{testing::TempDir()} / ("breakshot_" + std::to_string(getpid()) + "_camera.yaml");
  std::ofstream{file} << text;
  std::string message = "no error";
  try {
    (void)load_camera(file);
  } catch (const ConfigError& error) {
    message = error.what();
  }
  std::filesystem::remove(file);
  return message;
}

TEST(CameraFile, TheShippedCameraLooksStraightDown) {
  const CameraModel camera = load_camera(kFile);
  EXPECT_TRUE(camera.X_WC.linear().col(0).isApprox(Vector3::UnitX()));
  EXPECT_TRUE(camera.X_WC.linear().col(1).isApprox(-Vector3::UnitY()));
  EXPECT_TRUE(camera.X_WC.linear().col(2).isApprox(-Vector3::UnitZ()));
  EXPECT_NEAR(camera.X_WC.linear().determinant(), 1.0, 1e-12);
  const auto middle = camera.project(Vector3::Zero());
  ASSERT_TRUE(middle);
  EXPECT_TRUE(middle->isApprox(Vector2(camera.cx, camera.cy)));
  const auto right = camera.project({0.1, 0.0, 0.0});
  EXPECT_NEAR(right->x() - middle->x(), 0.1 / 0.8 * camera.fx, 1e-9);
  const auto up = camera.project({0.0, 0.1, 0.0});
  EXPECT_LT(up->y(), middle->y());
}

TEST(CameraFile, SeesEveryCentreInTheWorkspace) {
  const CameraModel camera = load_camera(kFile);
  for (const double x : {-0.3, 0.3}) {
    for (const double y : {-0.3, 0.3}) {
      const auto pixel = camera.project({x, y, 0.020});
      ASSERT_TRUE(pixel);
      EXPECT_GE(pixel->minCoeff(), 0.0);
      EXPECT_LE(pixel->x(), camera.width - 1.0);
      EXPECT_LE(pixel->y(), camera.height - 1.0);
    }
  }
}

TEST(CameraFile, RefusesCamerasThatCannotSee) {
  EXPECT_THAT(error_with("looks_along_W: [0, 0, -1]", "looks_along_W: [0, 0, 1]"),
              HasSubstr("found rays of the image that do not meet the table"));
  EXPECT_THAT(error_with("looks_along_W: [0, 0, -1]", "looks_along_W: [0, 0.9, -0.1]"), HasSubstr("do not meet the table"));
  EXPECT_THAT(error_with("looks_along_W: [0, 0, -1]", "looks_along_W: [0, 0, 0]"), HasSubstr("found a vector of length zero"));
  EXPECT_THAT(error_with("image_x_along_W: [1, 0, 0]", "image_x_along_W: [0, 0, 1]"), HasSubstr("not orthogonal"));
  EXPECT_THAT(error_with("fx: 914.0", "fx: -914.0"), HasSubstr("camera.fx: found -914.0; allowed: a number in [50, 10000] px"));
  EXPECT_THAT(error_with("fx: 914.0", "fx: .nan"), HasSubstr("camera.fx: found .nan"));
  EXPECT_THAT(error_with("cx: 639.0", "cx: 1280.0"), HasSubstr("camera.cx: found 1280.0"));
  EXPECT_THAT(error_with("width: 1280", "width: 1280.5"), HasSubstr("camera.width: found 1280.5"));
  EXPECT_THAT(error_with("distortion: [0, 0, 0, 0, 0]", "distortion: [0, 0, 0, 0]"), HasSubstr("found a list of 4; allowed: a list of 5"));
  EXPECT_THAT(error_with("distortion: [0, 0, 0, 0, 0]", "distortion: [-2, 0, 0, 0, 0]"), HasSubstr("cannot be undone"));
  EXPECT_THAT(error_with("p_WC: [0.0, 0.0, 0.8]", "p_WC: [0.0, 0.0, 0.1]"), HasSubstr("lower than 0.2 m"));
  EXPECT_THAT(error_with("  height: 720", "  hight: 720"), HasSubstr("camera.height: found no such key"));
  EXPECT_THAT(error_with("  height: 720", "  height: 720\n  skew: 1"), HasSubstr("camera.skew: found an unknown key"));
}

/// point_on_plane() undoes project() for any camera that looks down, with lenses as they are sold.
TEST(CameraModel, PointOnPlaneInvertsProject) {
  SplitMix64 random{3};
  for (int i = 0; i < 5'000; ++i) {
    CameraModel camera;
    camera.fx = random.uniform(600, 1200);
    camera.fy = camera.fx * random.uniform(0.98, 1.02);
    camera.cx = random.uniform(600, 680);
    camera.cy = random.uniform(330, 390);
    camera.distortion = {random.uniform(-0.2, 0.15), random.uniform(-0.05, 0.05), random.uniform(-2e-3, 2e-3), random.uniform(-2e-3, 2e-3),
                         random.uniform(-0.02, 0.02)};
    camera.X_WC.translation() = Vector3{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(0.6, 1.2)};
    camera.X_WC.linear() =
        (Eigen::AngleAxisd{random.uniform(-3, 3), Vector3::UnitZ()} * Eigen::AngleAxisd{random.uniform(2.9, 3.3), Vector3::UnitX()} *
         Eigen::AngleAxisd{random.uniform(-0.2, 0.2), Vector3::UnitY()})
            .toRotationMatrix();
    const double height = random.uniform(0.0, 0.05);
    const Vector2 p_W{camera.X_WC.translation().x() + random.uniform(-0.2, 0.2), camera.X_WC.translation().y() + random.uniform(-0.2, 0.2)};
    const auto pixel = camera.project({p_W.x(), p_W.y(), height});
    ASSERT_TRUE(pixel);
    EXPECT_LT((camera.point_on_plane(*pixel, height) - p_W).norm(), 1e-9);
  }
}

TEST(CameraModel, ParallaxOfTheDiscsHeight) {
  // What lies at height h and distance x from the axis seems to lie at x * Z / (Z - h) on the table: 6.4 mm at x = 0.25 m (singulation.md, 3).
  const CameraModel camera = load_camera(kFile);
  const auto pixel = camera.project({0.25, 0.0, 0.02});
  EXPECT_NEAR(camera.point_on_plane(*pixel, 0.0).x() - 0.25, 0.0064, 1e-4);
  EXPECT_NEAR(camera.point_on_plane(*pixel, 0.02).x(), 0.25, 1e-9);
}

TEST(CameraModel, PointsBehindTheCameraHaveNoPixel) {
  const CameraModel camera = load_camera(kFile);
  EXPECT_FALSE(camera.project({0.0, 0.0, 0.9}));
  EXPECT_FALSE(camera.project({0.0, 0.0, 0.8}));
}

}  // namespace
}  // namespace breakshot
