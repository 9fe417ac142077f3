#pragma once

#include "common/joints.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/arm/arm_dynamics.hpp"
#include "sim_bridge/arm/servo_drives.hpp"
#include "sim_bridge/world/ode.hpp"

#include <array>
#include <vector>

namespace breakshot::sim_bridge {

/// The arm as it is: one ODE body per moving link, hinges between them, gravity, and at each joint a rotor behind a gear that is turned by
/// a torque that never exceeds the drive's.
///
/// A world of its own, solved by ODE's direct method (dWorldStep), which keeps the hinges together to under a micrometre and passes an impact at the tip to
/// every link; the iterative method does neither (docs/simulator.md has the figures). Private to sim_bridge.
class ArmBody {
 public:
  ArmBody(const ArmDescription& arm, const Pose& X_WB, const DriveSettings& drives, const JointVector& q);

  /// One sub-step: the drives' torques for the reference, the outside force, then the bodies move. Once the arm stands still under an unchanging
  /// reference, the friction of its gearboxes holds it and a step does nothing.
  /// @param force_W  on the tip's origin during the whole sub-step, N
  void step(const DriveReference& reference, const Vector3& force_W, double dt);

  /// Lets the drives give only this share of their torque, 0 to 1: a fault.
  void weaken(double share) noexcept { torque_share_ = share; }

  const JointVector& q() const noexcept { return q_; }
  const JointVector& qd() const noexcept { return qd_; }
  const JointVector& tau() const noexcept { return tau_; }
  /// Largest share of its limit that any joint's torque reached since the start; 1 when one saturated.
  double peak_torque_share() const noexcept { return peak_torque_share_; }

  /// Posture by the joint angles, and the tip as the last ODE body has it.
  const ArmPosture& posture() const noexcept { return posture_; }
  Pose X_WL(int link) const noexcept;
  Vector3 w_WL(int link) const noexcept;
  Vector3 v_WL(int link) const noexcept;
  Pose X_WT() const noexcept;
  Vector3 v_WT() const noexcept;
  const ArmDynamics& dynamics() const noexcept { return dynamics_; }

 private:
  static constexpr int kSettleSteps = 40;

  void rest() noexcept;
  Vector3 velocity_at(int link, const Vector3& p_W) const noexcept;
  void read_joints() noexcept;

  int joints_;
  DriveSettings drives_;
  ArmDynamics dynamics_;
  JointVector max_torque_;
  JointVector q_, qd_, tau_;
  JointVector q_start_;  // ODE counts hinge angles from where the hinges were made
  ArmPosture posture_;
  double torque_share_ = 1.0;
  double peak_torque_share_ = 0.0;
  int still_steps_ = 0;

  ode::World world_;
  std::array<dBodyID, kMaxJoints> bodies_{};
  std::array<dJointID, kMaxJoints> hinges_{};
  std::array<Vector3, kMaxJoints> p_LCom_;
  Pose X_LT_;
};

}  // namespace breakshot::sim_bridge
