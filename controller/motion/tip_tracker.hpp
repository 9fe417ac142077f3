#pragma once

#include "controller/kinematics/arm_kinematics.hpp"

namespace breakshot::motion {

/// Follows a line of tip positions with the joints, the rod's axis held in one direction and its roll left free.
///
/// Newton's method from the joints of the neighbouring point, so it stays on the branch that it began on. Position and axis are five
/// conditions; what freedom is left (the roll about the rod, and the elbow of a 7-joint arm) goes where the joints move least. A last joint that
/// turns about the rod therefore does not move at all.
class TipTracker {
 public:
  explicit TipTracker(const kinematics::ArmKinematics& arm) : arm_{&arm} {}

  /// Moves q, a guess near the solution, so that the tip is at p_WT with its z axis along `axis_W` (unit), to about 1e-10 m and rad, and finds
  /// the joint speeds qd that move it on at v_WT_W without turning its axis. Returns false - q and qd are then of no use - when that takes
  /// more than a small step: a singular or unreachable point. q may lie outside the joints' ranges. About 1.4 us for a point 1 mm away.
  bool follow(const Vector3& p_WT, const Vector3& v_WT_W, const Vector3& axis_W, JointVector& q, JointVector& qd) const noexcept;

  /// Joint speeds that move the tip at v_WT_W without turning the rod's axis.
  JointVector joint_speed(const JointVector& q, const Vector3& v_WT_W) const noexcept;

  /// How far a posture is from a singular one: the tip's speed, in the direction in which it is slowest, when joint speeds of norm 1 rad/s move it
  /// without turning the rod's axis, m/rad; 0 in a singular posture. About 2 us.
  double singularity_margin(const JointVector& q) const noexcept;

 private:
  const kinematics::ArmKinematics* arm_;
};

}  // namespace breakshot::motion
