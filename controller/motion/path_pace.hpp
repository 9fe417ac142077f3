#pragma once

#include "controller/motion/path_stop.hpp"
#include "controller/motion/trajectory.hpp"

#include <cstddef>

namespace breakshot::motion {

/// Runs a trajectory at a path speed that changes smoothly to 0 or to 1 from whatever it is and however it changes: for a stroke that slows down while
/// nobody knows where the arm is, goes on when that is known again, or stops from there.
///
/// Between two changes it is what the trajectory says, only later: the path is kept, the set-points lie between the trajectory's ticks. Joint acceleration
/// and jerk keep StopLimits. (PathStop is the shorter way to rest from a trajectory at full speed.)
///
/// Real-time safe: no allocation, no lock, no exception, bounded: start() and change() look at no more than 88 ramps of 41 samples each.
class PathPace {
 public:
  explicit PathPace(const StopLimits& limits = {}) noexcept : limits_{limits} {}

  /// Begins at full path speed where the set-point of `tick` was the last one sent, and changes to `target`.
  ///
  /// @param trajectory  at least one point; must outlive the motion. Its joints keep MotionLimits that are within StopLimits.
  /// @param target      path speed, 0 or 1
  void start(const Trajectory& trajectory, std::size_t tick, double target) noexcept;
  /// From where it is now to another path speed.
  void change(double target) noexcept;
  double target() const noexcept { return target_; }

  /// The set-point of the next tick; at the end of the trajectory its last one, again and again. Returns whether the arm still moves.
  bool step(TrajectoryPoint& out) noexcept;

  /// Where the last set-point lies on the trajectory, in its ticks.
  double path_position() const noexcept { return position_; }
  bool at_end() const noexcept { return position_ >= static_cast<double>(trajectory_->size - 1); }

  /// Goes on along another copy of the same trajectory, as a replay has it.
  void follow(const Trajectory* copy) noexcept { trajectory_ = copy; }
  /// What it remembers, for the flight recorder: all but the limits and the trajectory itself.
  template <typename Self, typename Code>
  static void fields(Self& self, Code& code) {
    code(self.target_, self.start_, self.start_rate_, self.start_change_, self.acceleration_, self.elapsed_ticks_, self.position_,
         self.rate_, self.rate_change_);
  }
  /// Whether these are values that a motion can have; NaN is none.
  bool sound() const noexcept {
    constexpr auto kMostTicks = static_cast<double>(Trajectory::kCapacity);
    const auto within = [](double value, double low, double high) { return value >= low && value <= high; };
    return within(target_, 0.0, 1.0) && within(start_, 0.0, kMostTicks) && within(start_rate_, 0.0, kMostRate) &&
           within(start_change_, -1e3, 1e3) && within(acceleration_, 1e-3, 1e3) && within(position_, 0.0, kMostTicks) &&
           within(rate_, 0.0, kMostRate) && within(rate_change_, -1e3, 1e3) && elapsed_ticks_ >= 0 &&
           elapsed_ticks_ < static_cast<int>(Trajectory::kCapacity) * 100;
  }

 private:
  /// Most path speed that a ramp may pass through. The trajectory was checked for 1; a joint at its full speed would be caught by the loop's limiter.
  static constexpr double kMostRate = 1.05;

  /// Takes the fastest ramp that is admissible. @return false when none is, and the gentlest was taken
  bool choose(double most_rate) noexcept;
  bool admissible(double acceleration, double most_rate) const noexcept;

  StopLimits limits_;
  const Trajectory* trajectory_ = nullptr;
  double target_ = 1.0;
  // The ramp under way, as it began.
  double start_ = 0.0;         ///< path position, ticks
  double start_rate_ = 1.0;    ///< path speed
  double start_change_ = 0.0;  ///< its change, 1/s
  double acceleration_ = 1.0;  ///< most that the path speed changes, 1/s
  int elapsed_ticks_ = 0;
  // The last set-point.
  double position_ = 0.0;
  double rate_ = 1.0;
  double rate_change_ = 0.0;
};

}  // namespace breakshot::motion
