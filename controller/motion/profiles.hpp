#pragma once

#include <algorithm>
#include <cmath>

namespace breakshot::motion {

/// A change of speed from v0 to v1 with bounded acceleration and jerk, in the shortest time; v1 from then on.
class SpeedRamp {
 public:
  SpeedRamp() = default;
  /// @param acceleration, jerk  > 0
  SpeedRamp(double v0, double v1, double acceleration, double jerk) noexcept : v0_{v0}, v1_{v1} {
    const double change = std::abs(v1 - v0);
    if (change >= acceleration * acceleration / jerk) {
      jerk_time_ = acceleration / jerk;
      flat_time_ = change / acceleration - jerk_time_;
    } else {
      jerk_time_ = std::sqrt(change / jerk);
    }
    jerk_ = v1 >= v0 ? jerk : -jerk;
  }

  double duration() const noexcept { return 2.0 * jerk_time_ + flat_time_; }
  /// Way from the start to the end of the change. The profile is symmetric, so its mean speed is the middle one.
  double length() const noexcept { return 0.5 * (v0_ + v1_) * duration(); }

  double speed(double t) const noexcept {
    t = std::clamp(t, 0.0, duration());
    const double rest = duration() - t;
    if (t < jerk_time_) return v0_ + 0.5 * jerk_ * t * t;
    if (rest < jerk_time_) return v1_ - 0.5 * jerk_ * rest * rest;
    return v0_ + jerk_ * jerk_time_ * (t - 0.5 * jerk_time_);
  }

  double position(double t) const noexcept {
    if (t <= 0.0) return v0_ * t;
    const double rest = duration() - t;
    if (rest <= 0.0) return length() - v1_ * rest;
    if (t < jerk_time_) return v0_ * t + jerk_ * t * t * t / 6.0;
    if (rest < jerk_time_) return length() - v1_ * rest + jerk_ * rest * rest * rest / 6.0;
    const double y = t - jerk_time_;
    const double at_flat = v0_ * jerk_time_ + jerk_ * jerk_time_ * jerk_time_ * jerk_time_ / 6.0;
    return at_flat + (v0_ + 0.5 * jerk_ * jerk_time_ * jerk_time_) * y + 0.5 * jerk_ * jerk_time_ * y * y;
  }

 private:
  double v0_ = 0.0, v1_ = 0.0;
  double jerk_ = 0.0;       ///< signed
  double jerk_time_ = 0.0;  ///< of each of the two phases in which acceleration changes
  double flat_time_ = 0.0;  ///< of the phase of constant acceleration between them
};

/// Rising from rest with constant acceleration, which is either there from the start or built up at the given jerk.
class Rise {
 public:
  Rise() = default;
  Rise(double acceleration, double jerk, bool starts_accelerated) noexcept
      : acceleration_{acceleration}, jerk_{jerk}, jerk_time_{starts_accelerated ? 0.0 : acceleration / jerk} {}

  double height(double t) const noexcept {
    if (t <= 0.0) return 0.0;
    if (t < jerk_time_) return jerk_ * t * t * t / 6.0;
    const double y = t - jerk_time_;
    return jerk_ * jerk_time_ * jerk_time_ * jerk_time_ / 6.0 + 0.5 * jerk_ * jerk_time_ * jerk_time_ * y + 0.5 * acceleration_ * y * y;
  }
  double speed(double t) const noexcept {
    if (t <= 0.0) return 0.0;
    if (t < jerk_time_) return 0.5 * jerk_ * t * t;
    return 0.5 * jerk_ * jerk_time_ * jerk_time_ + acceleration_ * (t - jerk_time_);
  }
  /// When `height` is reached.
  double time_to(double height) const noexcept {
    const double low = jerk_ * jerk_time_ * jerk_time_ * jerk_time_ / 6.0;
    if (height <= low) return std::cbrt(6.0 * height / jerk_);
    const double v = 0.5 * jerk_ * jerk_time_ * jerk_time_;
    return jerk_time_ + (std::sqrt(v * v + 2.0 * acceleration_ * (height - low)) - v) / acceleration_;
  }

 private:
  double acceleration_ = 1.0, jerk_ = 1.0, jerk_time_ = 0.0;
};

}  // namespace breakshot::motion
