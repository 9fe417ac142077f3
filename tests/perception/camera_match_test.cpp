#include "perception/camera_match.hpp"

#include "tests/perception/synthetic_image.hpp"

#include <gtest/gtest.h>

namespace breakshot::perception::test {
namespace {

TEST(CameraMatch, AcceptsTheSameCalibrationAfterRounding) {
  const CameraModel camera = test_camera(true);
  CameraModel other = camera;
  other.fx += 1e-9;
  other.X_WC.translation().x() += 1e-12;
  EXPECT_EQ(camera_mismatch(camera, other), std::nullopt);
}

TEST(CameraMatch, NamesTheFigureThatDiffers) {
  const CameraModel camera = test_camera();
  const auto mismatch = [&](auto change) {
    CameraModel other = camera;
    change(other);
    return camera_mismatch(camera, other).value_or("none");
  };
  EXPECT_EQ(mismatch([](CameraModel& c) { c.width = 640; }), "width: found 640; the calibration file says 1280");
  EXPECT_EQ(mismatch([](CameraModel& c) { c.fx = 900.0; }), "fx: found 900; the calibration file says 915");
  EXPECT_EQ(mismatch([](CameraModel& c) { c.distortion[4] = 0.1; }), "distortion k3: found 0.1; the calibration file says 0");
  EXPECT_EQ(mismatch([](CameraModel& c) { c.X_WC.translation().z() = 0.75; }), "p_WC z: found 0.75; the calibration file says 0.8");
  EXPECT_EQ(mismatch([](CameraModel& c) { c.X_WC.rotate(Eigen::AngleAxisd{0.1, Vector3::UnitZ()}); }).rfind("turn away", 0), 0U);
}

}  // namespace
}  // namespace breakshot::perception::test
