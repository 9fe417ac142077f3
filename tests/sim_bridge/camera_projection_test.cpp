#include "common/config/camera_file.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "tests/sim_bridge/camera_picture.hpp"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include <cmath>
#include <numbers>
#include <optional>
#include <random>

namespace breakshot::sim_bridge {
namespace {

constexpr double kHeight = 0.020;

/// Where, along `direction` from `pixel`, the picture crosses half of the step between what is inside and outside, px.
std::optional<double> edge_offset(const ColorFrame& frame, const Vector2& pixel, const Vector2& direction) {
  constexpr double kReach = 3.0, kStep = 0.05;
  const Vector2 in = pixel - kReach * direction, out = pixel + kReach * direction;
  for (const Vector2& end : {in, out}) {
    if (end.x() < 1 || end.y() < 1 || end.x() > frame.width - 3 || end.y() > frame.height - 3) return std::nullopt;
  }
  int channel = 0;  // the one with the clearest step
  for (int c = 1; c < 3; ++c) {
    if (std::abs(value_at(frame, in, c) - value_at(frame, out, c)) >
        std::abs(value_at(frame, in, channel) - value_at(frame, out, channel))) {
      channel = c;
    }
  }
  // Inside, the shading still changes a little towards the edge: take its value nearby.
  const double inside = value_at(frame, pixel - 1.6 * direction, channel), outside = value_at(frame, out, channel);
  if (std::abs(inside - outside) < 30.0) return std::nullopt;
  const auto covered = [&](double offset) { return (value_at(frame, pixel + offset * direction, channel) - outside) / (inside - outside); };
  for (double offset = -1.5; offset < 1.5; offset += kStep) {
    const double here = covered(offset), next = covered(offset + kStep);
    if (here >= 0.5 && next < 0.5) return offset + kStep * (here - 0.5) / (here - next);
  }
  return std::nullopt;
}

struct EdgeErrors {
  int points = 0;
  double mean = 0.0;        ///< outwards, px
  Vector2 shift{0.0, 0.0};  ///< that explains them, px
  double largest = 0.0;
};

/// Compares the outline of a disc in the picture with where CameraModel::project puts it: the rim of the top where that stands against
/// the table, and the foot where the side is seen.
EdgeErrors compare_outline(const support::RenderedScene& scene, const DiscState& disc) {
  EdgeErrors errors;
  const Vector3 p_WC = scene.camera.X_WC.translation();
  Matrix2 normal_sum = Matrix2::Zero();
  Vector2 weighted = Vector2::Zero();
  for (int i = 0; i < 120; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 120;
    const Vector2 outward{std::cos(angle), std::sin(angle)};
    const Vector2 rim = disc.p_WD + disc.radius * outward;
    const double facing = outward.dot(p_WC.head<2>() - rim);
    if (std::abs(facing) < 0.02) continue;  // between the two the outline is the straight side
    const double z = facing > 0.0 ? 0.0 : disc.height;
    const auto pixel = scene.camera.project({rim.x(), rim.y(), z});
    const Vector2 beyond = disc.p_WD + (disc.radius + 1e-3) * outward;
    const auto outer = scene.camera.project({beyond.x(), beyond.y(), z});
    // The outline's normal in the picture, from its tangent.
    const Vector2 along = disc.p_WD + disc.radius * Vector2{std::cos(angle + 1e-3), std::sin(angle + 1e-3)};
    const Vector2 tangent = (*scene.camera.project({along.x(), along.y(), z}) - *pixel).normalized();
    Vector2 normal = perpendicular(tangent);
    if (normal.dot(*outer - *pixel) < 0.0) normal = -normal;
    const auto offset = edge_offset(scene.color, *pixel, normal);
    if (!offset) continue;
    ++errors.points;
    errors.mean += *offset;
    errors.largest = std::max(errors.largest, std::abs(*offset));
    normal_sum += normal * normal.transpose();
    weighted += *offset * normal;
  }
  if (errors.points > 0) {
    errors.mean /= errors.points;
    errors.shift = normal_sum.inverse() * weighted;
  }
  return errors;
}

void expect_outlines_agree(const CameraModel& camera, const char* name) {
  SCOPED_TRACE(name);
  support::SceneRenderer renderer{plain_settings(), camera};
  std::mt19937 random{7};
  double worst_mean = 0.0, worst_shift = 0.0;
  for (int picture = 0; picture < 3; ++picture) {
    std::vector<DiscState> discs;
    for (const double x : {-0.25, -0.125, 0.0, 0.125, 0.25}) {
      for (const double y : {-0.2, 0.0, 0.2}) {
        std::uniform_real_distribution<double> nudge{-0.02, 0.02};
        discs.push_back(support::disc_at(x + nudge(random), y + nudge(random), static_cast<std::uint8_t>(discs.size() % 3),
                                         0.02 + 0.015 * static_cast<double>(discs.size() % 2)));
      }
    }
    const auto scene = renderer.take(discs);
    for (const DiscState& disc : discs) {
      const EdgeErrors errors = compare_outline(scene, disc);
      if (errors.points < 60) continue;  // cut by the image's border
      EXPECT_LT(std::abs(errors.mean), 0.05) << "disc at " << disc.p_WD.transpose();
      EXPECT_LT(errors.shift.norm(), 0.08) << "disc at " << disc.p_WD.transpose();
      EXPECT_LT(errors.largest, 0.45) << "disc at " << disc.p_WD.transpose();
      worst_mean = std::max(worst_mean, std::abs(errors.mean));
      worst_shift = std::max(worst_shift, errors.shift.norm());
    }
  }
  std::printf("%s: outlines off by at most %.3f px in radius, %.3f px in place\n", name, worst_mean, worst_shift);
}

TEST(CameraProjection, OutlinesLieWhereTheCameraModelPutsThem) {
  expect_outlines_agree(support::cell_camera(), "straight down");
  expect_outlines_agree(tilted_camera(), "tilted");
}

TEST(CameraProjection, OutlinesFollowADistortingLens) {
  CameraModel camera = support::cell_camera();
  camera.distortion = {-0.17, 0.04, 0.001, -0.0008, 0.0};  // a wide-angle lens: 40 px in the corners
  expect_outlines_agree(camera, "distorting lens");
}

/// Where OpenCV, which knows nothing of our camera model, sees a point.
Vector2 by_opencv(const CameraModel& camera, const Vector3& p_W) {
  const Vector3 p_C = camera.X_WC.inverse() * p_W;
  const cv::Matx33d intrinsics{camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(std::vector{cv::Point3d{p_C.x(), p_C.y(), p_C.z()}}, cv::Vec3d{}, cv::Vec3d{}, intrinsics, camera.distortion, pixels);
  return {pixels.front().x, pixels.front().y};
}

TEST(CameraProjection, OutlinesUnderALensLieWhereOpenCvProjectsThem) {
  const CameraModel camera = load_camera(BREAKSHOT_SOURCE_DIR "/config/cameras/d435i_lens.yaml");
  support::SceneRenderer renderer{plain_settings(), camera};
  double bent = 0.0;
  for (const double x : {-0.45, -0.2, 0.1, 0.42}) {
    for (const double y : {-0.2, 0.0, 0.22}) {
      for (const double radius : {0.02, 0.05}) {
        const auto disc = support::disc_at(x, y, 2, radius);
        const auto scene = renderer.take({&disc, 1});
        double mean = 0.0;
        int points = 0;
        for (int i = 0; i < 90; ++i) {
          const double angle = 2.0 * std::numbers::pi * i / 90;
          const Vector2 outward{std::cos(angle), std::sin(angle)};
          const Vector2 rim = disc.p_WD + radius * outward;
          if (outward.dot(rim) < 0.02) continue;  // there the side, not the top, stands against the table
          const auto seen = [&](double a) { return by_opencv(camera, {x + radius * std::cos(a), y + radius * std::sin(a), disc.height}); };
          const Vector2 pixel = seen(angle);
          Vector2 normal = perpendicular((seen(angle + 1e-3) - pixel).normalized());
          if (normal.dot(pixel - by_opencv(camera, {x, y, disc.height})) < 0.0) normal = -normal;
          const auto offset = edge_offset(scene.color, pixel, normal);
          if (!offset) continue;
          ++points;
          mean += *offset;
          CameraModel straight = camera;
          straight.distortion = {};
          bent = std::max(bent, (*straight.project({rim.x(), rim.y(), disc.height}) - pixel).norm());
        }
        if (points < 20) continue;  // out of the picture, or all of it below the camera
        EXPECT_LT(std::abs(mean / points), 0.05) << x << " " << y << " " << radius;
      }
    }
  }
  EXPECT_GT(bent, 5.0) << "the lens bends";
}

TEST(CameraProjection, TheModelIsOpenCvs) {
  const CameraModel camera = load_camera(BREAKSHOT_SOURCE_DIR "/config/cameras/d435i_lens.yaml");
  const Projector projector{camera};
  for (double x = -0.5; x <= 0.5; x += 0.1) {
    for (double y = -0.3; y <= 0.3; y += 0.1) {
      const Vector3 p_W{x, y, 0.1 * x * x};
      EXPECT_LT((projector.project(p_W).pixel - by_opencv(camera, p_W)).norm(), 1e-9) << p_W.transpose();
    }
  }
}

TEST(CameraProjection, ClipCoordinatesAreThePixelsOfTheModel) {
  CameraModel distorted = tilted_camera();
  distorted.distortion = {0.12, -0.2, 0.001, 0.002, 0.05};
  std::mt19937 random{3};
  std::uniform_real_distribution<double> place{-0.3, 0.3};
  for (const CameraModel& model : {support::cell_camera(), tilted_camera(), distorted}) {
    const Projector projector{model};
    for (int i = 0; i < 1000; ++i) {
      const Vector3 p_W{place(random), 0.5 * place(random), 0.2 * std::abs(place(random))};
      const auto expected = model.project(p_W);
      const ProjectedPoint projected = projector.project(p_W);
      ASSERT_TRUE(projected.in_front);
      EXPECT_LT((projected.pixel - *expected).norm(), 1e-6);
      const Vector2 window{0.5 * (projected.clip.x() / projected.clip.w() + 1.0) * model.width - 0.5,
                           0.5 * (projected.clip.y() / projected.clip.w() + 1.0) * model.height - 0.5};
      EXPECT_LT((window - *expected).norm(), 1e-3);
      EXPECT_NEAR(projected.clip.w(), (model.X_WC.inverse() * p_W).z(), 1e-6);
    }
  }
}

TEST(CameraProjection, RefusesWhatIsNoLens) {
  CameraModel folding = support::cell_camera();
  folding.distortion[0] = -2.0;
  EXPECT_THROW(Projector{folding}, CameraError);
  CameraModel flat = support::cell_camera();
  flat.fx = 0.0;
  EXPECT_THROW(Projector{flat}, CameraError);
  CameraModel huge = support::cell_camera();
  huge.width = 100'000;
  EXPECT_THROW(Projector{huge}, CameraError);
  CameraModel nowhere = support::cell_camera();
  nowhere.X_WC.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Projector{nowhere}, CameraError);
}

TEST(CameraProjection, DepthIsAlongTheOpticalAxis) {
  for (const CameraModel& camera : {support::cell_camera(), tilted_camera()}) {
    support::SceneRenderer renderer{plain_settings(), camera};
    const auto disc = support::disc_at(0.05, -0.04, 0);
    const auto scene = renderer.take({&disc, 1});
    const auto expect_depth = [&](const Vector3& p_W) {
      const auto pixel = camera.project(p_W);
      const Vector2 whole{std::round(pixel->x()), std::round(pixel->y())};
      const Vector2 seen = camera.point_on_plane(whole, p_W.z());
      const double z = (camera.X_WC.inverse() * Vector3{seen.x(), seen.y(), p_W.z()}).z();
      EXPECT_NEAR(depth_at(scene.depth, whole), 1e4 * z, 1.01) << p_W.transpose();
    };
    for (const double x : {-0.2, -0.1, 0.0, 0.2}) {
      for (const double y : {-0.15, 0.1, 0.15}) expect_depth({x, y, 0.0});
    }
    for (const Vector2& offset : {Vector2{0.0, 0.0}, Vector2{0.02, 0.01}, Vector2{-0.02, 0.0}}) {
      expect_depth({disc.p_WD.x() + offset.x(), disc.p_WD.y() + offset.y(), kHeight});
    }
  }
}

}  // namespace
}  // namespace breakshot::sim_bridge
