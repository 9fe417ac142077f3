#pragma once

#include "controller/kinematics/arm_kinematics.hpp"

#include <cmath>
#include <random>

namespace breakshot::support {

/// Joint positions drawn evenly from the arm's ranges: a pose made from them is reachable within limits by construction.
inline JointVector random_joints(const kinematics::ArmKinematics& arm, std::mt19937& random) {
  JointVector q(arm.joints());
  for (int i = 0; i < arm.joints(); ++i) q[i] = std::uniform_real_distribution{arm.lower()[i], arm.upper()[i]}(random);
  return q;
}

struct PoseDifference {
  double position;  ///< m
  double rotation;  ///< rad
};

inline PoseDifference difference(const Pose& a, const Pose& b) {
  // The chord between the rotation matrices: exact for small angles, where the trace has lost its digits.
  const double chord = (a.linear() - b.linear()).norm() / std::sqrt(2.0);
  return {(a.translation() - b.translation()).norm(), 2.0 * std::asin(std::min(1.0, 0.5 * chord))};
}

}  // namespace breakshot::support
