#pragma once

#include "controller/safety/joint_setpoint.hpp"

namespace breakshot::safety {

/// Brakes every joint by itself with its maximum deceleration: the shortest stop there is, not on the path.
///
/// Position and speed stay continuous. A joint that is too near to its limit to stop before it is held at the limit: with set-points that passed the
/// limiter this takes a position within the braking distance of the limit (at 3.1 rad/s and 10 rad/s^2: 0.5 rad).
///
/// @param from  set-point to start from
/// @param span  s, > 0
/// @return the set-point `span` later; its qd is exactly zero once the joint has stopped
/// Cost: no allocation, about 20 ns. The time to standstill is |qd| / max_acceleration of the slowest joint.
Setpoint brake(const JointLimits& limits, const Setpoint& from, double span) noexcept;

/// One step of every joint towards `target`, within the acceleration and at most with `max_speed`; comes to rest there.
///
/// @param target     within the limits' range, rad
/// @param max_speed  rad/s, > 0
/// @param span       s, > 0
Setpoint approach(const JointLimits& limits, const Setpoint& from, const JointArray& target, double max_speed, double span) noexcept;

}  // namespace breakshot::safety
