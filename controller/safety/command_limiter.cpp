#include "controller/safety/command_limiter.hpp"

#include <cmath>

namespace breakshot::safety {

namespace {

using Kind = LimitViolation::Kind;

constexpr double kRoundOff = 1e-6;  // rad, rad/s: a thousandth of what an encoder resolves
constexpr double kAccelerationFactor = 1.1;

LimitViolation check_joint(const JointLimits& limits, std::size_t j, const Setpoint& last, const Setpoint& next, double span) noexcept {
  const int joint = static_cast<int>(j);
  const double q = next.q[j];
  const double qd = next.qd[j];
  if (!std::isfinite(q) || !std::isfinite(qd) || !std::isfinite(next.qdd[j])) return {Kind::kNotFinite, joint, q, 0.0};

  if (q < limits.lower[j] - kRoundOff) return {Kind::kPosition, joint, q, limits.lower[j]};
  if (q > limits.upper[j] + kRoundOff) return {Kind::kPosition, joint, q, limits.upper[j]};
  if (std::abs(qd) > limits.max_speed[j] + kRoundOff) return {Kind::kSpeed, joint, qd, limits.max_speed[j]};

  const double max_acceleration = kAccelerationFactor * limits.max_acceleration[j];
  const double acceleration = (qd - last.qd[j]) / span;
  if (std::abs(acceleration) > max_acceleration + kRoundOff / span) return {Kind::kAcceleration, joint, acceleration, max_acceleration};

  // With bounded acceleration, the way between two speeds differs from the trapezoid of these speeds by at most a span^2 / 4 (full
  // acceleration for one half of the span, full deceleration for the other).
  const double way = q - last.q[j];
  const double trapezoid = 0.5 * (last.qd[j] + qd) * span;
  const double max_deviation = 0.25 * max_acceleration * span * span + kRoundOff;
  if (std::abs(way - trapezoid) > max_deviation) return {Kind::kJump, joint, way - trapezoid, max_deviation};
  return {};
}

}  // namespace

LimitViolation check_command(const JointLimits& limits, const Setpoint& last, const Setpoint& next, double span) noexcept {
  for (std::size_t j = 0; j < static_cast<std::size_t>(limits.joints); ++j) {
    if (const auto violation = check_joint(limits, j, last, next, span)) return violation;
  }
  return {};
}

const char* to_string(Kind kind) noexcept {
  switch (kind) {
    case Kind::kNone: return "none";
    case Kind::kNotFinite: return "not finite";
    case Kind::kPosition: return "position range";
    case Kind::kSpeed: return "speed";
    case Kind::kAcceleration: return "acceleration";
    case Kind::kJump: return "jump";
  }
  return "invalid";
}

}  // namespace breakshot::safety
