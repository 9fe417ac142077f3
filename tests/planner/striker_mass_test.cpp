// planner.knowledge.striker_mass can be known before anything has been hit: it follows from the arm's description.

#include "common/urdf/cell_arm.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "planner/planner_config.hpp"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace breakshot::planner {
namespace {

constexpr double kPi = std::numbers::pi;

/// What a drive adds to its joint through the gear, kg m^2: the UR5e in MuJoCo Menagerie. No URDF says it, a vendor's data sheet does.
constexpr double kRotorInertia = 0.1;

/// Inertia of the joints at q, kg m^2: what every link's mass and inertia come to through the velocities that the joints give it.
Eigen::MatrixXd joint_inertia(const ArmDescription& arm, const kinematics::ArmKinematics& kinematics, const JointVector& q) {
  const auto n = static_cast<Eigen::Index>(arm.links.size());
  std::vector<Pose> X_WL(arm.links.size());
  (void)kinematics.links_in_world(q, X_WL);
  Eigen::MatrixXd M = kRotorInertia * Eigen::MatrixXd::Identity(n, n);
  for (std::size_t link = 0; link < arm.links.size(); ++link) {
    Eigen::MatrixXd J_v = Eigen::MatrixXd::Zero(3, n), J_w = J_v;
    const Vector3 p_WCom = X_WL[link] * arm.links[link].p_LCom;
    for (std::size_t joint = 0; joint <= link; ++joint) {
      const Vector3 axis_W = X_WL[joint].linear() * arm.joints[joint].axis_L;
      J_w.col(static_cast<Eigen::Index>(joint)) = axis_W;
      J_v.col(static_cast<Eigen::Index>(joint)) = axis_W.cross(p_WCom - X_WL[joint].translation());
    }
    const Matrix3 I_W = X_WL[link].linear() * arm.links[link].I_Com_L * X_WL[link].linear().transpose();
    M += arm.links[link].mass * J_v.transpose() * J_v + J_w.transpose() * I_W * J_w;
  }
  return M;
}

TEST(StrikerMass, IsWhatTheArmsDescriptionSaysOfTheTip) {
  const ConfigDocument document = load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml");
  const CellConfig cell = load_cell_config(document);
  const ArmDescription arm = load_cell_arm(cell);
  const kinematics::ArmKinematics kinematics{arm, cell.arm.X_WB};
  const kinematics::InverseKinematics inverse{kinematics};

  // 1 / (n' J M^-1 J' n) along every direction in the plane, all over the workspace, the rod upright and turned as near to the park pose as can be.
  std::vector<double> masses;
  for (const double x : {-0.24, -0.12, 0.0, 0.12, 0.24}) {
    for (const double y : {-0.24, -0.12, 0.0, 0.12, 0.24}) {
      Pose X_WT{Pose::Identity()};
      X_WT.translation() << x, y, cell.tip_height;
      X_WT.linear() = Eigen::AngleAxisd{kPi, Vector3::UnitX()}.toRotationMatrix();
      const auto solutions = inverse.solve(X_WT, cell.arm.park);
      ASSERT_FALSE(solutions.empty());
      kinematics::Jacobian J;
      (void)kinematics.tip_in_world(*solutions.begin(), J);
      const Eigen::MatrixXd mobility =
          J.topRows<2>() * joint_inertia(arm, kinematics, *solutions.begin()).ldlt().solve(J.topRows<2>().transpose());
      for (double bearing = 0.0; bearing < kPi; bearing += kPi / 8) {
        const Vector2 n{std::cos(bearing), std::sin(bearing)};
        masses.push_back(1.0 / n.dot(mobility * n));
      }
    }
  }
  std::sort(masses.begin(), masses.end());
  const double median = masses[masses.size() / 2];
  RecordProperty("median_kg", std::to_string(median));
  RecordProperty("p10_kg", std::to_string(masses[masses.size() / 10]));
  RecordProperty("p90_kg", std::to_string(masses[masses.size() * 9 / 10]));
  // A disc of 0.1 kg takes (1 + e) M / (M + 0.1) of the striker's speed, so that a quarter of M is 2 % of the speed.
  EXPECT_NEAR(load_planner_config(document, cell).settings.cell.striker_mass, median, 0.1 * median);
}

}  // namespace
}  // namespace breakshot::planner
