#include "controller/motion/path_pace.hpp"

#include "controller/motion/path_derivatives.hpp"
#include "controller/motion/profiles.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::motion {
namespace {

/// Ramps are tried from this fast, each slower than the one before by the factor. The fastest is for strokes that hardly move a joint; the slowest (0.2/s)
/// is within StopLimits for whatever keeps MotionLimits.
constexpr double kFastest = 64.0;  // 1/s
constexpr double kSlower = 0.88;
constexpr int kTries = 44;
/// Samples of a ramp; between them joint speed and acceleration change little.
constexpr int kSamples = 40;
/// The limits are kept at the samples; this keeps what lies between them, and the rounding, inside as well.
constexpr double kShare = 0.98;

}  // namespace

void PathPace::start(const Trajectory& trajectory, std::size_t tick, double target) noexcept {
  trajectory_ = &trajectory;
  position_ = static_cast<double>(std::min(tick, trajectory.size - 1));
  rate_ = 1.0;
  rate_change_ = 0.0;
  change(target);
}

void PathPace::change(double target) noexcept {
  target_ = target;
  start_ = position_;
  start_rate_ = rate_;
  start_change_ = rate_change_;
  elapsed_ticks_ = 0;
  if (!choose(1.0)) {
    // A stop while the path speed rises towards 1 goes past it by some of what was missing, unless it is abrupt.
    choose(kMostRate);
  }
}

bool PathPace::choose(double most_rate) noexcept {
  const double gentlest = std::abs(start_change_);  // no gentler ramp begins as this one has to
  acceleration_ = kFastest;
  for (int i = 0; i < kTries && acceleration_ > gentlest; ++i, acceleration_ *= kSlower) {
    if (admissible(acceleration_, most_rate)) return true;
  }
  acceleration_ = std::max(acceleration_, gentlest);
  return false;
}

bool PathPace::admissible(double acceleration, double most_rate) const noexcept {
  const double jerk = acceleration * limits_.jerk / limits_.acceleration;
  const SpeedRamp ramp{start_rate_, start_change_, target_, acceleration, jerk};
  const double h = to_seconds(trajectory_->tick);
  const double duration = ramp.duration();
  PathDerivatives path;
  for (int k = 0; k <= kSamples; ++k) {
    const double t = duration * k / kSamples;
    path_at(*trajectory_, start_ + ramp.position(t) / h, path);
    const double s = ramp.speed(t);
    const double s1 = ramp.change(t);
    if (s > most_rate + 1e-9) return false;
    for (std::size_t j = 0; j < static_cast<std::size_t>(trajectory_->joints); ++j) {
      if (std::abs(path.d2[j] * s * s + path.d1[j] * s1) > kShare * limits_.acceleration) return false;
      const double trend = std::abs(path.d3[j] * s * s * s + 3.0 * path.d2[j] * s * s1);
      if (trend + std::abs(path.d1[j]) * jerk > kShare * limits_.jerk) return false;
    }
  }
  return true;
}

bool PathPace::step(TrajectoryPoint& out) noexcept {
  const double h = to_seconds(trajectory_->tick);
  const double last = static_cast<double>(trajectory_->size - 1);
  const SpeedRamp ramp{start_rate_, start_change_, target_, acceleration_, acceleration_ * limits_.jerk / limits_.acceleration};
  ++elapsed_ticks_;
  const double t = elapsed_ticks_ * h;
  position_ = std::min(start_ + std::max(0.0, ramp.position(t) / h), last);
  rate_ = std::clamp(ramp.speed(t), 0.0, kMostRate);
  rate_change_ = ramp.change(t);
  PathDerivatives path;
  path_at(*trajectory_, position_, path);
  out.phase = path.phase;
  for (std::size_t j = 0; j < static_cast<std::size_t>(trajectory_->joints); ++j) {
    out.q[j] = path.q[j];
    out.qd[j] = path.d1[j] * rate_;
    out.qdd[j] = path.d2[j] * rate_ * rate_ + path.d1[j] * rate_change_;
  }
  return position_ < last && (target_ > 0.0 || t < ramp.duration());
}

}  // namespace breakshot::motion
