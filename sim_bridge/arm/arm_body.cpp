#include "sim_bridge/arm/arm_body.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::sim_bridge {
namespace {

/// Below these the drives' friction holds the arm where it is: a tenth of the resolution of a 20-bit encoder.
constexpr double kStillAngle = 6e-7;  // rad
constexpr double kStillSpeed = 1e-5;  // rad/s

}  // namespace

ArmBody::ArmBody(const ArmDescription& arm, const Pose& X_WB, const DriveSettings& drives, const JointVector& q)
    : joints_{static_cast<int>(arm.joints.size())},
      drives_{drives},
      dynamics_{arm, X_WB, drives.rotor_inertia},
      max_torque_(joints_),
      q_{q},
      qd_{JointVector::Zero(joints_)},
      tau_{JointVector::Zero(joints_)},
      q_start_{q},
      posture_{dynamics_.posture(q)},
      X_LT_{arm.X_LT} {
  dWorldSetGravity(world_.id(), 0.0, 0.0, -kGravity);
  dWorldSetCFM(world_.id(), 0.0);  // a serial chain's hinges are never redundant, so they need no softness
  dBodyID parent = nullptr;
  for (int i = 0; i < joints_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const LinkDescription& link = arm.links[k];
    const Matrix3& I = link.I_Com_L;
    max_torque_[i] = arm.joints[k].max_torque;
    p_LCom_[k] = link.p_LCom;

    bodies_[k] = dBodyCreate(world_.id());
    dMass mass;
    dMassSetParameters(&mass, link.mass, 0.0, 0.0, 0.0, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    dBodySetMass(bodies_[k], &mass);
    const Pose& X_WL = posture_.X_WL[k];
    ode::set_pose(bodies_[k], X_WL * Eigen::Translation3d{link.p_LCom});

    hinges_[k] = dJointCreateHinge(world_.id(), nullptr);
    dJointAttach(hinges_[k], bodies_[k], parent);
    const Vector3 p = X_WL.translation();
    const Vector3& axis = posture_.axis_W[k];
    dJointSetHingeAnchor(hinges_[k], p.x(), p.y(), p.z());
    dJointSetHingeAxis(hinges_[k], axis.x(), axis.y(), axis.z());
    dJointSetHingeParam(hinges_[k], dParamFMax, dInfinity);
    parent = bodies_[k];
  }
}

void ArmBody::step(const DriveReference& reference, const Vector3& force_W, double dt) {
  const bool pushed = !force_W.isZero(0.0);
  const bool still = !pushed && torque_share_ == 1.0 && reference.qd.isZero(0.0) && qd_.cwiseAbs().maxCoeff() < kStillSpeed &&
                     (reference.q - q_).cwiseAbs().maxCoeff() < kStillAngle;
  still_steps_ = still ? std::min(still_steps_ + 1, kSettleSteps) : 0;
  if (still_steps_ == kSettleSteps) {
    rest();
    return;
  }

  // Computed torque: the drives know the arm's dynamics and close a critically damped loop round what the model leaves over.
  const JointVector error = reference.q - q_;
  const JointVector speed_error = reference.qd - qd_;
  const JointVector wanted = reference.qdd + 2.0 * drives_.bandwidth * speed_error + drives_.bandwidth * drives_.bandwidth * error;
  const JointVector limit = torque_share_ * max_torque_;
  tau_ = dynamics_.torque(posture_, qd_, wanted).cwiseMin(limit).cwiseMax(-limit);
  peak_torque_share_ = std::max(peak_torque_share_, (tau_.array().abs() / max_torque_.array()).maxCoeff());

  // The rotor: I (qd' - qd) / dt = tau - load, where the load is what it passes on to the joint. Written as qd' + (dt / I) load = qd + (dt / I) tau, that is
  // ODE's joint motor with this softness and this target speed, solved together with the hinges.
  const double softness = dt / drives_.rotor_inertia;
  for (int i = 0; i < joints_; ++i) {
    const dJointID hinge = hinges_[static_cast<std::size_t>(i)];
    dJointSetHingeParam(hinge, dParamCFM, softness);
    dJointSetHingeParam(hinge, dParamVel, qd_[i] + softness * tau_[i]);
  }
  if (pushed) {
    const Vector3 p = X_WT().translation();
    dBodyAddForceAtPos(bodies_[static_cast<std::size_t>(joints_ - 1)], force_W.x(), force_W.y(), force_W.z(), p.x(), p.y(), p.z());
  }
  dWorldStep(world_.id(), dt);
  read_joints();
}

void ArmBody::rest() noexcept {
  if (qd_.isZero(0.0)) return;
  for (int i = 0; i < joints_; ++i) {
    dBodySetLinearVel(bodies_[static_cast<std::size_t>(i)], 0.0, 0.0, 0.0);
    dBodySetAngularVel(bodies_[static_cast<std::size_t>(i)], 0.0, 0.0, 0.0);
  }
  qd_.setZero();
}

void ArmBody::read_joints() noexcept {
  for (int i = 0; i < joints_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    // ODE's angle is in [-pi, pi]; a joint turns less than half a turn per sub-step, so the turn nearest to the last angle is the right one.
    const double angle = q_start_[i] + dJointGetHingeAngle(hinges_[k]);
    q_[i] = angle + 2.0 * std::numbers::pi * std::round((q_[i] - angle) / (2.0 * std::numbers::pi));
    qd_[i] = dJointGetHingeAngleRate(hinges_[k]);
  }
  posture_ = dynamics_.posture(q_);
}

Pose ArmBody::X_WL(int link) const noexcept {
  const auto k = static_cast<std::size_t>(link);
  return ode::pose(bodies_[k]) * Eigen::Translation3d{-p_LCom_[k]};
}

Pose ArmBody::X_WT() const noexcept { return X_WL(joints_ - 1) * X_LT_; }

Vector3 ArmBody::w_WL(int link) const noexcept { return ode::to_vector(dBodyGetAngularVel(bodies_[static_cast<std::size_t>(link)])); }

Vector3 ArmBody::v_WL(int link) const noexcept { return velocity_at(link, X_WL(link).translation()); }

Vector3 ArmBody::v_WT() const noexcept { return velocity_at(joints_ - 1, X_WT().translation()); }

Vector3 ArmBody::velocity_at(int link, const Vector3& p_W) const noexcept {
  const dBodyID body = bodies_[static_cast<std::size_t>(link)];
  return ode::to_vector(dBodyGetLinearVel(body)) + w_WL(link).cross(p_W - ode::to_vector(dBodyGetPosition(body)));
}

}  // namespace breakshot::sim_bridge
