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

    // A start outside the range (the arm itself may be there) is not pulled back in: that would be a jump.
    const double lower = std::min(limits.lower[j], from.q[j]);
    const double upper = std::max(limits.upper[j], from.q[j]);
    if (next.q[j] < lower || next.q[j] > upper) {
      next.q[j] = std::clamp(next.q[j], lower, upper);
      next.qd[j] = 0.0;
      next.qdd[j] = 0.0;
    }
  }
  return next;
}

}  // namespace breakshot::safety
