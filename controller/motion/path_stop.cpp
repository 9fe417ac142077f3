#include "controller/motion/path_stop.hpp"

#include "controller/motion/path_derivatives.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::motion {
namespace {

/// Share of the stop's time in which the deceleration grows (and, at the end, falls again). A fifth keeps the ratio of jerk to
/// acceleration near that of StopLimits for stops of about a quarter second, which are the ones that matter.
constexpr double kRamp = 0.2;
constexpr double kPeak = 1.0 / (1.0 - kRamp);  ///< largest deceleration of the path speed over a stop of unit duration

/// Stops are searched among durations that grow by this factor, between these bounds. The longest one is hardly slower than letting the
/// stroke run on: whatever keeps MotionLimits is admissible long before it.
constexpr int kShortestTicks = 20;
constexpr int kLongestTicks = 1500;
constexpr double kGrowth = 1.07;
/// Samples of a candidate; between them joint speed and acceleration change little.
constexpr int kSamples = 40;

/// Path speed and its derivatives, over a stop of unit duration, and the path covered so far.
struct Progress {
  double covered;  ///< integral of speed from 0 to x
  double speed;    ///< 1 at x = 0, 0 at x = 1
  double change;   ///< d speed / dx
  double change2;  ///< d^2 speed / dx^2
};

Progress progress(double x) noexcept {
  if (x <= 0.0) return {0.0, 1.0, 0.0, 0.0};
  if (x >= 1.0) return {0.5, 0.0, 0.0, 0.0};
  // Symmetric about (1/2, 1/2): the second half is the first one turned round.
  if (x > 0.5) {
    const Progress mirror = progress(1.0 - x);
    return {0.5 - (1.0 - x) + mirror.covered, 1.0 - mirror.speed, mirror.change, -mirror.change2};
  }
  constexpr double kSlope = kPeak / kRamp;
  if (x < kRamp) return {x - kSlope * x * x * x / 6.0, 1.0 - 0.5 * kSlope * x * x, -kSlope * x, -kSlope};
  const double y = x - kRamp;
  constexpr double kSpeedR = 1.0 - 0.5 * kPeak * kRamp;
  constexpr double kCoveredR = kRamp - kPeak * kRamp * kRamp / 6.0;
  return {kCoveredR + kSpeedR * y - 0.5 * kPeak * y * y, kSpeedR - kPeak * y, -kPeak, 0.0};
}

bool at_rest(const TrajectoryPoint& point) noexcept {
  const auto zero = [](double x) { return x == 0.0; };
  return std::all_of(point.qd.begin(), point.qd.end(), zero) && std::all_of(point.qdd.begin(), point.qdd.end(), zero);
}

}  // namespace

void PathStop::start(const Trajectory& trajectory, std::size_t tick) noexcept {
  trajectory_ = &trajectory;
  start_ = position_ = static_cast<double>(std::min(tick, trajectory.size - 1));
  elapsed_ticks_ = 0;
  duration_ticks_ = 0;
  if (at_rest(trajectory.points[static_cast<std::size_t>(start_)])) return;
  duration_ticks_ = kShortestTicks;
  while (duration_ticks_ < kLongestTicks && !admissible(duration_ticks_)) {
    duration_ticks_ = std::min(kLongestTicks, static_cast<int>(std::ceil(duration_ticks_ * kGrowth)));
  }
}

bool PathStop::admissible(int duration_ticks) const noexcept {
  const double duration = duration_ticks * to_seconds(trajectory_->tick);
  PathDerivatives path;
  for (int k = 0; k <= kSamples; ++k) {
    const Progress p = progress(static_cast<double>(k) / kSamples);
    path_at(*trajectory_, start_ + p.covered * duration_ticks, path);
    const double s = p.speed;
    const double s1 = p.change / duration;
    const double s2 = p.change2 / (duration * duration);
    for (std::size_t j = 0; j < static_cast<std::size_t>(trajectory_->joints); ++j) {
      if (std::abs(path.d2[j] * s * s + path.d1[j] * s1) > limits_.acceleration) return false;
      if (std::abs(path.d3[j] * s * s * s + 3.0 * path.d2[j] * s * s1 + path.d1[j] * s2) > limits_.jerk) return false;
    }
  }
  return true;
}

bool PathStop::step(TrajectoryPoint& out) noexcept {
  if (trajectory_ == nullptr) return false;
  elapsed_ticks_ = std::min(elapsed_ticks_ + 1, duration_ticks_);
  Progress p{0.0, 0.0, 0.0, 0.0};
  double rate_change = 0.0;
  if (duration_ticks_ > 0) {
    p = progress(static_cast<double>(elapsed_ticks_) / duration_ticks_);
    rate_change = p.change / (duration_ticks_ * to_seconds(trajectory_->tick));
  }
  position_ = std::min(start_ + p.covered * duration_ticks_, static_cast<double>(trajectory_->size - 1));
  PathDerivatives path;
  path_at(*trajectory_, position_, path);
  out.phase = path.phase;
  for (std::size_t j = 0; j < static_cast<std::size_t>(trajectory_->joints); ++j) {
    out.q[j] = path.q[j];
    out.qd[j] = path.d1[j] * p.speed;
    out.qdd[j] = path.d2[j] * p.speed * p.speed + path.d1[j] * rate_change;
  }
  return elapsed_ticks_ < duration_ticks_ && position_ < static_cast<double>(trajectory_->size - 1);
}

}  // namespace breakshot::motion
