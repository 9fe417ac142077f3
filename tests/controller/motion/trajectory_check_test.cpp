#include "controller/motion/trajectory_check.hpp"

#include "controller/kinematics/arm_kinematics.hpp"
#include "tests/support/arms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace breakshot::motion {
namespace {

constexpr double kTick = 1e-3;  // s

/// Joint 1 at the given accelerations from tick to tick, with points' qdd as a planner has them that differences its speeds about each point.
std::unique_ptr<Trajectory> with_accelerations(const std::vector<double>& acceleration) {
  auto trajectory = std::make_unique<Trajectory>();
  trajectory->joints = 6;
  trajectory->tick = std::chrono::milliseconds{1};
  trajectory->size = acceleration.size() + 1;
  for (std::size_t k = 1; k < trajectory->size; ++k) {
    TrajectoryPoint& now = trajectory->points[k];
    const TrajectoryPoint& last = trajectory->points[k - 1];
    now.qd[0] = last.qd[0] + kTick * acceleration[k - 1];
    now.q[0] = last.q[0] + 0.5 * kTick * (last.qd[0] + now.qd[0]);
    now.qdd[0] = 0.5 * (acceleration[k - 1] + acceleration[std::min(k, acceleration.size() - 1)]);
  }
  return trajectory;
}

class TrajectoryCheck : public testing::Test {
 protected:
  TrajectoryUse use(const std::vector<double>& acceleration) const {
    const auto trajectory = with_accelerations(acceleration);
    return measure(*trajectory, 0, trajectory->size, limits_, clearance_);
  }

  const ArmDescription arm_ = support::ur5e();
  const kinematics::ArmKinematics kinematics_{arm_, Pose::Identity()};
  const ArmClearance clearance_{arm_, kinematics_, 0.010};
  const JointLimits limits_{kinematics_.lower(), kinematics_.upper(), kinematics_.max_speed(), 10.0, 200.0};
};

// Found by 4000 random strokes: the jump of an acceleration within one tick, which points' own accelerations spread over two.
TEST_F(TrajectoryCheck, SeesAJerkThatLastsATick) {
  EXPECT_NEAR(use({0.0, 0.0, 0.2, 0.4, 0.6, 0.6, 0.6}).jerk, 1.0, 1e-9);
  EXPECT_NEAR(use({0.0, 0.0, 0.3, 0.3, 0.3, 0.3, 0.3}).jerk, 1.5, 1e-9);
}

TEST_F(TrajectoryCheck, SeesAnAccelerationThatLastsATick) { EXPECT_NEAR(use({9.8, 9.8, 10.2, 9.8, 9.8}).acceleration, 1.02, 1e-9); }

}  // namespace
}  // namespace breakshot::motion
