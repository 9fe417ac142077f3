#pragma once

#include "common/joints.hpp"

#include <array>

namespace breakshot::safety {

/// One number per joint, base to tip; entries past the arm's number of joints are zero. Plain, so it crosses threads as it is.
using JointArray = std::array<double, kMaxJoints>;

/// Where every joint is to be, at one instant.
struct Setpoint {
  JointArray q{};    ///< rad
  JointArray qd{};   ///< rad/s
  JointArray qdd{};  ///< rad/s^2

  bool at_rest() const noexcept { return qd == JointArray{}; }
};

/// What every command is held against, whoever made it.
struct JointLimits {
  int joints = 0;                 ///< 1 to kMaxJoints
  JointArray lower{}, upper{};    ///< rad
  JointArray max_speed{};         ///< rad/s
  JointArray max_acceleration{};  ///< rad/s^2
};

}  // namespace breakshot::safety
