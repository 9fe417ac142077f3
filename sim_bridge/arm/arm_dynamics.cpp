#include "sim_bridge/arm/arm_dynamics.hpp"

#include <Eigen/Cholesky>

#include <stdexcept>

namespace breakshot::sim_bridge {

ArmDynamics::ArmDynamics(const ArmDescription& arm, const Pose& X_WB, double rotor_inertia)
    : joints_{static_cast<int>(arm.joints.size())}, links_{}, X_WB_{X_WB}, X_LT_{arm.X_LT}, rotor_inertia_{rotor_inertia} {
  if (arm.joints.empty() || arm.joints.size() > std::size_t{kMaxJoints} || arm.links.size() != arm.joints.size()) {
    throw std::invalid_argument{"an arm needs 1 to 7 joints and one link per joint"};
  }
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    const JointDescription& joint = arm.joints[i];
    const LinkDescription& link = arm.links[i];
    links_[i] = {joint.X_PL, joint.axis_L, link.mass, link.p_LCom, link.I_Com_L};
  }
}

ArmPosture ArmDynamics::posture(const JointVector& q) const noexcept {
  ArmPosture posture;
  posture.joints = joints_;
  Pose X_WP = X_WB_;
  for (int i = 0; i < joints_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    X_WP = X_WP * links_[k].X_PL * Eigen::AngleAxisd{q[i], links_[k].axis_L};
    posture.X_WL[k] = X_WP;
    posture.axis_W[k] = X_WP.linear() * links_[k].axis_L;
  }
  posture.X_WT = X_WP * X_LT_;
  return posture;
}

JointVector ArmDynamics::newton_euler(const ArmPosture& posture, const JointVector& qd, const JointVector& qdd,
                                      double gravity) const noexcept {
  std::array<Vector3, kMaxJoints> force;   // that moves link i, through its centre of mass
  std::array<Vector3, kMaxJoints> moment;  // that turns it, about its origin

  // Outwards: velocities and accelerations. Gravity enters as an upward acceleration of the base.
  Vector3 omega = Vector3::Zero();
  Vector3 alpha = Vector3::Zero();
  Vector3 acceleration{0.0, 0.0, gravity};
  Vector3 origin = X_WB_.translation();
  for (int i = 0; i < joints_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vector3& axis = posture.axis_W[k];
    const Vector3 step = posture.X_WL[k].translation() - origin;
    acceleration += alpha.cross(step) + omega.cross(omega.cross(step));
    origin = posture.X_WL[k].translation();
    alpha += axis * qdd[i] + omega.cross(axis) * qd[i];
    omega += axis * qd[i];

    const Matrix3 R_WL = posture.X_WL[k].linear();
    const Vector3 arm = R_WL * links_[k].p_LCom;
    const Matrix3 inertia = R_WL * links_[k].I_Com_L * R_WL.transpose();
    force[k] = links_[k].mass * (acceleration + alpha.cross(arm) + omega.cross(omega.cross(arm)));
    moment[k] = inertia * alpha + omega.cross(inertia * omega) + arm.cross(force[k]);
  }

  // Inwards: what each joint carries.
  JointVector tau = JointVector::Zero(joints_);
  Vector3 carried_force = Vector3::Zero();
  Vector3 carried_moment = Vector3::Zero();  // about the origin of the link further out
  Vector3 outer_origin = Vector3::Zero();
  for (int i = joints_ - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    const Vector3& p = posture.X_WL[k].translation();
    carried_moment = moment[k] + carried_moment + (outer_origin - p).cross(carried_force);
    carried_force += force[k];
    outer_origin = p;
    tau[i] = posture.axis_W[k].dot(carried_moment) + rotor_inertia_ * qdd[i];
  }
  return tau;
}

JointVector ArmDynamics::torque(const ArmPosture& posture, const JointVector& qd, const JointVector& qdd) const noexcept {
  return newton_euler(posture, qd, qdd, kGravity);
}

MassMatrix ArmDynamics::mass_matrix(const ArmPosture& posture) const noexcept {
  const JointVector still = JointVector::Zero(joints_);
  MassMatrix M(joints_, joints_);
  for (int i = 0; i < joints_; ++i) {
    JointVector unit = still;
    unit[i] = 1.0;
    M.col(i) = newton_euler(posture, still, unit, 0.0);
  }
  return M;
}

TipJacobian ArmDynamics::tip_jacobian(const ArmPosture& posture) const noexcept {
  TipJacobian J(3, joints_);
  for (int i = 0; i < joints_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    J.col(i) = posture.axis_W[k].cross(posture.X_WT.translation() - posture.X_WL[k].translation());
  }
  return J;
}

Matrix2 ArmDynamics::tip_mobility(const ArmPosture& posture) const noexcept {
  const Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, kMaxJoints> J = tip_jacobian(posture).topRows<2>();
  const Eigen::LDLT<MassMatrix> M{mass_matrix(posture)};
  return J * M.solve(J.transpose());
}

}  // namespace breakshot::sim_bridge
