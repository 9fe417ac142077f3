#pragma once

#include "controller/kinematics/closed_form.hpp"

#include <array>
#include <optional>

namespace breakshot::kinematics {

/// Closed-form inverse kinematics of six-joint arms whose axes 2, 3 and 4 are parallel and whose axes 5 and 6 meet: the UR class.
///
/// Works on the screw axes at q = 0 and not on Denavit-Hartenberg figures, so it does not matter how a URDF places its frames.
/// Derivation: the meeting point P of axes 5 and 6 depends on q1..q4 only, and turns about the parallel axes keep P's component along
/// them: that gives q1. The angle between axis 6 and the parallel direction gives q5, the parallel direction seen from the flange gives q6,
/// what rotation is left is q2 + q3 + q4, and the remaining position is a planar arm of two links.
class ParallelAxesIk {
 public:
  /// Nothing when the arm's geometry is not of this class (axes parallel to 1e-6 rad, meeting to 1e-6 m).
  static std::optional<ParallelAxesIk> recognise(const ArmKinematics& arm);

  /// All branches for a tip pose in the base frame, joints in [-pi, pi], limits not considered. Where joint 6 is free (axis 6 parallel to the
  /// three) it takes q6_if_free. No allocation, about 3 us.
  Branches solve(const Pose& X_BT, double q6_if_free) const noexcept;

 private:
  ParallelAxesIk() = default;

  std::array<Axis, 6> axes_;
  double sign3_ = 1.0, sign4_ = 1.0;  ///< +1 when axis 3 (4) points along axis 2, -1 when against it
  Vector3 meeting_;                   ///< P at q = 0, in B
  Vector3 p_TP_;                      ///< P in the tip frame: fixed
  Matrix3 R_home_;                    ///< of the tip at q = 0
};

}  // namespace breakshot::kinematics
