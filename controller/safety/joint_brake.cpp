#include "controller/safety/joint_brake.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::safety {

Setpoint brake(const JointLimits& limits, const Setpoint& from, double span) noexcept {
  Setpoint next;
  for (std::size_t j = 0; j < static_cast<std::size_t>(limits.joints); ++j) {
    const double speed = from.qd[j];
    const double deceleration = -std::copysign(limits.max_acceleration[j], speed);
    const double to_rest = std::abs(speed) / limits.max_acceleration[j];
    const double moving = std::min(span, to_rest);
    const bool stopped = to_rest <= span;

    next.q[j] = from.q[j] + (speed + 0.5 * deceleration * moving) * moving;
    next.qd[j] = stopped ? 0.0 : speed + deceleration * span;
    next.qdd[j] = stopped ? 0.0 : deceleration;

    if (next.q[j] < limits.lower[j] || next.q[j] > limits.upper[j]) {
      next.q[j] = std::clamp(next.q[j], limits.lower[j], limits.upper[j]);
      next.qd[j] = 0.0;
      next.qdd[j] = 0.0;
    }
  }
  return next;
}

Setpoint approach(const JointLimits& limits, const Setpoint& from, const JointArray& target, double max_speed, double span) noexcept {
  Setpoint next;
  for (std::size_t j = 0; j < static_cast<std::size_t>(limits.joints); ++j) {
    const double way = target[j] - from.q[j];
    // Half of the deceleration that there is, so that the speed which falls with the square root of the way can be kept up with in steps.
    const double stoppable = std::sqrt(limits.max_acceleration[j] * std::abs(way));
    const double wanted = std::copysign(std::min({max_speed, stoppable, std::abs(way) / span}), way);
    const double change = limits.max_acceleration[j] * span;
    next.qd[j] = std::clamp(wanted, from.qd[j] - change, from.qd[j] + change);
    next.q[j] = from.q[j] + 0.5 * (from.qd[j] + next.qd[j]) * span;
    next.qdd[j] = (next.qd[j] - from.qd[j]) / span;
  }
  return next;
}

}  // namespace breakshot::safety
