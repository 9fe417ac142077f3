#pragma once

#include <algorithm>
#include <cmath>

namespace breakshot::motion {

/// A change of speed to v1 with bounded acceleration and jerk, in the shortest time; v1 from then on.
class SpeedRamp {
 public:
  SpeedRamp() = default;
  /// No change.
  explicit SpeedRamp(double v) noexcept : v0_{v}, v1_{v} {}
  /// From v0, where the acceleration is a0 already.
  /// @param acceleration  > 0 and at least |a0|
  /// @param jerk          > 0
  SpeedRamp(double v0, double a0, double v1, double acceleration, double jerk) noexcept : v0_{v0}, a0_{a0}, v1_{v1} {
    // Up or down, seen from the speed that letting go of a0 leads to.
    const double up = v1 >= v0 + 0.5 * a0 * std::abs(a0) / jerk ? 1.0 : -1.0;
    jerk_ = up * jerk;
    const double start = up * a0;
    const double change = up * (v1 - v0);
    double peak = std::sqrt(std::max(0.0, jerk * change + 0.5 * start * start));
    if (peak > acceleration) {
      peak = acceleration;
      flat_time_ = (change - (peak * peak - 0.5 * start * start) / jerk) / peak;
    }
    build_time_ = std::max(0.0, (peak - start) / jerk);
    end_time_ = peak / jerk;
  }

  double duration() const noexcept { return build_time_ + flat_time_ + end_time_; }
  double length() const noexcept { return position(duration()); }

  double speed(double t) const noexcept {
    if (t <= 0.0) return v0_;
    const double rest = duration() - t;
    if (rest <= 0.0) return v1_;
    if (rest < end_time_) return v1_ - 0.5 * jerk_ * rest * rest;
    const double b = std::min(t, build_time_);
    return v0_ + a0_ * b + 0.5 * jerk_ * b * b + (a0_ + jerk_ * build_time_) * (t - b);
  }

  /// The acceleration.
  double change(double t) const noexcept {
    if (t < 0.0 || t >= duration()) return 0.0;
    const double rest = duration() - t;
    return rest < end_time_ ? jerk_ * rest : a0_ + jerk_ * std::min(t, build_time_);
  }

  double position(double t) const noexcept {
    if (t <= 0.0) return v0_ * t;
    const double b = std::min(t, build_time_);
    double way = v0_ * b + 0.5 * a0_ * b * b + jerk_ * b * b * b / 6.0;
    if (t <= build_time_) return way;
    const double v = v0_ + a0_ * b + 0.5 * jerk_ * b * b;
    const double a = a0_ + jerk_ * b;
    const double f = std::min(t - build_time_, flat_time_);
    way += v * f + 0.5 * a * f * f;
    if (t <= build_time_ + flat_time_) return way;
    const double e = std::min(t - build_time_ - flat_time_, end_time_);
    way += (v + a * f) * e + 0.5 * a * e * e - jerk_ * e * e * e / 6.0;
    return way + v1_ * (t - build_time_ - flat_time_ - e);
  }

 private:
  double v0_ = 0.0, a0_ = 0.0, v1_ = 0.0;
  double jerk_ = 0.0;        ///< signed
  double build_time_ = 0.0;  ///< acceleration goes from a0 to its peak
  double flat_time_ = 0.0;   ///< stays there
  double end_time_ = 0.0;    ///< and returns to 0
};

/// Rising from rest with constant acceleration, which is either there from the start or built up at the given jerk.
class Rise {
 public:
  Rise() = default;
  Rise(double acceleration, double jerk, bool starts_accelerated) noexcept
      : acceleration_{acceleration}, jerk_{jerk}, jerk_time_{starts_accelerated ? 0.0 : acceleration / jerk} {}

  bool starts_accelerated() const noexcept { return jerk_time_ == 0.0; }
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
