#pragma once

#include "controller/safety/joint_setpoint.hpp"

#include <cstdint>

namespace breakshot::safety {

/// A limit that a command would break.
struct LimitViolation {
  enum class Kind : std::uint8_t {
    kNone = 0,
    kNotFinite = 1,
    kPosition = 2,      ///< outside the joint's range, rad
    kSpeed = 3,         ///< rad/s
    kAcceleration = 4,  ///< change of speed since the last command, rad/s^2
    kJump = 5,          ///< the position does not follow from the speeds, rad
  };
  Kind kind = Kind::kNone;
  int joint = -1;
  double value = 0.0;  ///< found
  double limit = 0.0;  ///< allowed

  explicit operator bool() const noexcept { return kind != Kind::kNone; }
};

/// The last line of defence: looks at every command against the one before, whoever made it.
///
/// Trajectories are checked when they are planned; this catches what should not be possible (a bug, a torn hand-over, a bit error) before the drives
/// see it. kRoundOff lets pass what is right but for rounding; the acceleration bound allows 10 % because a point-to-point difference is not
/// the acceleration at a point.
///
/// @param last  the command before
/// @param next  the command to be judged
/// @param span  time between the two, s, > 0
/// Cost: no allocation, about 30 ns.
LimitViolation check_command(const JointLimits& limits, const Setpoint& last, const Setpoint& next, double span) noexcept;

const char* to_string(LimitViolation::Kind kind) noexcept;

}  // namespace breakshot::safety
