#include "tests/sim_bridge/cell_arm.hpp"

#include "sim_bridge/arm/arm_dynamics.hpp"
#include "tests/support/arms.hpp"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include <array>

namespace breakshot::sim_bridge {

ArmDescription cell_arm() {
  ArmDescription arm = support::ur5e();
  // universal-robots.com, "Parameters for calculations of kinematics and dynamics": masses; centres of mass moved into these link frames.
  constexpr std::array kMass{3.761, 8.058, 2.846, 1.37, 1.3, 0.565};  // the last with the striker's 0.2 kg
  constexpr std::array kTorque{150.0, 150.0, 150.0, 28.0, 28.0, 28.0};
  const std::array<Vector3, 6> com{Vector3{0, -0.002, 0.137},  Vector3{-0.2125, 0, 0.113}, Vector3{-0.242, 0, 0.0265},
                                   Vector3{0, -0.016, 0.1315}, Vector3{0, 0.016, 0.0979},  Vector3{0, 0, 0.12}};
  // Solid cylinders of about the links' sizes: length along which axis, and how long.
  const std::array<Vector3, 6> size{Vector3{0.06, 0.06, 0.15}, Vector3{0.42, 0.06, 0.06}, Vector3{0.39, 0.05, 0.05},
                                    Vector3{0.05, 0.05, 0.1},  Vector3{0.05, 0.05, 0.1},  Vector3{0.04, 0.04, 0.25}};
  for (std::size_t i = 0; i < 6; ++i) {
    arm.links[i].mass = kMass[i];
    arm.links[i].p_LCom = com[i];
    const Vector3 squares = size[i].cwiseProduct(size[i]);
    arm.links[i].I_Com_L = kMass[i] / 12.0 * (Vector3::Constant(squares.sum()) - squares).asDiagonal().toDenseMatrix();
    arm.joints[i].max_torque = kTorque[i];
  }
  return arm;
}

Pose cell_base() {
  Pose X_WB = Pose::Identity();
  X_WB.translation() << -0.5, 0.0, 0.0;
  return X_WB;
}

JointVector pose_over(const Vector3& p_WT) {
  const ArmDynamics arm{cell_arm(), cell_base(), 0.0};
  JointVector q(6);
  q << 3.14, -1.2, 1.6, -2.0, -1.57, 0.0;
  double error = 1.0;
  for (int i = 0; i < 500 && error > 1e-12; ++i) {
    const ArmPosture posture = arm.posture(q);
    Eigen::Matrix<double, 6, 6> J;
    J.topRows<3>() = arm.tip_jacobian(posture);
    for (int k = 0; k < 6; ++k) J.col(k).tail<3>() = posture.axis_W[static_cast<std::size_t>(k)];
    Eigen::Matrix<double, 6, 1> e;
    e.head<3>() = p_WT - posture.X_WT.translation();
    const Matrix3 R = Eigen::AngleAxisd{M_PI, Vector3::UnitX()}.toRotationMatrix() * posture.X_WT.linear().transpose();
    const Eigen::AngleAxisd turn{R};
    e.tail<3>() = turn.angle() * turn.axis();
    error = e.norm();
    const Eigen::Matrix<double, 6, 6> A = J * J.transpose() + 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
    q += J.transpose() * A.ldlt().solve(e * std::min(1.0, 0.3 / error));
  }
  EXPECT_LT(error, 1e-9) << "no pose over " << p_WT.transpose();
  return q;
}

}  // namespace breakshot::sim_bridge
