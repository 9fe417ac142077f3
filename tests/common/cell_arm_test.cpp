// The shipped cell fits together: the arm reaches what it must, and gets out of the camera's way.

#include "common/urdf/cell_arm.hpp"
#include "common/config/camera_file.hpp"
#include "common/config/cell_config.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace breakshot {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

class ShippedCell : public testing::Test {
 protected:
  const CellConfig cell_ = load_cell_config(load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml"));
  const ArmDescription arm_ = load_cell_arm(cell_);
  const CameraModel camera_ = load_camera(cell_.camera_file);
  const kinematics::ArmKinematics kinematics_{arm_, cell_.arm.X_WB};
};

/// Points on the surface of a solid, in the link's frame.
std::vector<Vector3> surface(const Shape& shape) {
  std::vector<Vector3> points;
  const auto add = [&](const Vector3& p_S) { points.push_back(shape.X_LS * p_S); };
  for (double u = -0.5; u <= 0.5; u += 0.125) {
    for (int k = 0; k < 16; ++k) {
      const double angle = kPi / 8 * k;
      switch (shape.kind) {
        case Shape::Kind::kCylinder: add({shape.size.x() * std::cos(angle), shape.size.x() * std::sin(angle), u * shape.size.y()}); break;
        case Shape::Kind::kSphere:
          add(shape.size.x() * Vector3{std::cos(angle) * std::cos(kPi * u), std::sin(angle) * std::cos(kPi * u), std::sin(kPi * u)});
          break;
        case Shape::Kind::kBox: add(shape.size.cwiseProduct(Vector3{u, k < 8 ? -0.5 : 0.5, k % 2 == 0 ? -0.5 : 0.5})); break;
      }
    }
  }
  return points;
}

TEST_F(ShippedCell, ReachesTheWholeWorkspaceWithTheStrikerVerticalAtEveryYaw) {
  const kinematics::InverseKinematics inverse{kinematics_};
  // 30 mm around the workspace: a stroke begins outside the disc that it meets.
  const Rect reach = cell_.workspace.grown(0.030);
  for (int ix = 0; ix <= 22; ++ix) {
    for (int iy = 0; iy <= 22; ++iy) {
      for (int yaw = 0; yaw < 8; ++yaw) {
        Pose X_WT{Pose::Identity()};
        const Vector2 share{ix / 22.0, iy / 22.0};
        X_WT.translation() << reach.min + share.cwiseProduct(reach.max - reach.min), cell_.tip_height;
        X_WT.linear() = (Eigen::AngleAxisd{kPi / 4 * yaw, Vector3::UnitZ()} * Eigen::AngleAxisd{kPi, Vector3::UnitX()}).toRotationMatrix();
        const auto solutions = inverse.solve(X_WT, cell_.arm.park);
        ASSERT_FALSE(solutions.empty()) << X_WT.translation().transpose() << " yaw " << 45 * yaw;
        EXPECT_TRUE(kinematics_.tip_in_world(*solutions.begin()).isApprox(X_WT, 1e-6));
      }
    }
  }
}

TEST_F(ShippedCell, ParksWithTheTipHighAndTheElbowUp) {
  std::vector<Pose> X_WL(arm_.links.size());
  const Pose X_WT = kinematics_.links_in_world(cell_.arm.park, X_WL);
  EXPECT_GT(X_WT.translation().z(), 0.15);
  EXPECT_LT(X_WT.linear().col(2).z(), -0.9) << "the striker hangs down, so a transit need not turn it far";
  EXPECT_GT(X_WL[2].translation().z(), 0.4);
}

/// Nothing of the parked arm stands between the camera and a disc that lies in the workspace.
TEST_F(ShippedCell, ParksOutOfTheCamerasViewOfTheWorkspace) {
  std::vector<Pose> X_WL(arm_.links.size());
  (void)kinematics_.links_in_world(cell_.arm.park, X_WL);
  const Rect watched = cell_.workspace.grown(cell_.disc_radius_max);
  double nearest = 1.0;
  const auto check = [&](const Pose& X_WB, const LinkDescription& link) {
    for (const Shape& shape : link.collisions) {
      for (const Vector3& p_L : surface(shape)) {
        const auto pixel = camera_.project(X_WB * p_L);
        if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > camera_.width - 1 || pixel->y() > camera_.height - 1) continue;
        const double margin = -watched.margin(camera_.point_on_plane(*pixel, 0.0));
        EXPECT_GT(margin, 0.0) << link.name << " at " << (X_WB * p_L).transpose();
        nearest = std::min(nearest, margin);
      }
    }
  };
  check(cell_.arm.X_WB, arm_.base);
  for (std::size_t i = 0; i < arm_.links.size(); ++i) check(X_WL[i], arm_.links[i]);
  RecordProperty("clearance_mm", std::to_string(1e3 * nearest));
}

TEST_F(ShippedCell, RefusesAParkPoseThatDoesNotFitTheArm) {
  CellConfig cell = cell_;
  cell.arm.park = JointVector::Zero(5);
  try {
    (void)load_cell_arm(cell);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cell.arm.park_deg: found 5 angles; allowed: 6"));
  }
  cell.arm.park = JointVector::Zero(6);
  cell.arm.park[2] = 3.5;
  try {
    (void)load_cell_arm(cell);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cell.arm.park_deg[2]: found 200.5"));
  }
}

}  // namespace
}  // namespace breakshot
