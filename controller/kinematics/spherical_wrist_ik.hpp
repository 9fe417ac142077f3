#pragma once

#include "controller/kinematics/closed_form.hpp"

#include <array>
#include <optional>

namespace breakshot::kinematics {

/// Closed-form inverse kinematics of six-joint arms with a spherical wrist and a parallel shoulder and elbow: axes 4, 5 and 6 meet in one
/// point, axes 2 and 3 are parallel. Most industrial arms are of this class.
///
/// Works on the screw axes at q = 0, like ParallelAxesIk, so offsets between the axes do not matter. Derivation: the wrist centre P depends on
/// q1..q3 only, and turns about the parallel axes keep P's component along them: that gives q1. What is left of the way to P is a planar
/// arm of two links: q2 and q3. The rotation that remains is the wrist's, about three known axes: q4, q5 and q6.
class SphericalWristIk {
 public:
  /// Nothing when the arm's geometry is not of this class (axes parallel to 1e-6 rad, meeting to 1e-6 m).
  static std::optional<SphericalWristIk> recognise(const ArmKinematics& arm);

  /// All branches for a tip pose in the base frame, joints in [-pi, pi], limits not considered. Where axes 4 and 6 fall together, joint 4 is
  /// q4_if_free. No allocation, about 3 us.
  Branches solve(const Pose& X_BT, double q4_if_free) const noexcept;

 private:
  SphericalWristIk() = default;

  std::array<Axis, 6> axes_;
  double sign3_ = 1.0;  ///< +1 when axis 3 points along axis 2, -1 when against it
  Vector3 centre_;      ///< P at q = 0, in B
  Vector3 p_TP_;        ///< P in the tip frame: fixed
  Matrix3 R_home_;      ///< of the tip at q = 0
};

}  // namespace breakshot::kinematics
