#pragma once

#include "controller/motion/trajectory.hpp"

#include <cstddef>

namespace breakshot::motion {

/// What a stop may ask of every joint. More than strokes may use (MotionLimits), so that a stop fits on top of whatever the stroke does.
struct StopLimits {
  double acceleration = 20.0;  ///< rad/s^2; our choice: from pi rad/s to rest in 0.25 s, well below the 300 ms that issue 3 allows
  double jerk = 600.0;         ///< rad/s^3; our choice: full deceleration after 33 ms
};

/// Brings the arm to rest from any tick of a trajectory without leaving its path.
///
/// Runs the trajectory at a path speed that falls smoothly from 1 to 0 over the shortest time that keeps every joint within StopLimits, so
/// position, speed and acceleration are continuous and the stop passes only through configurations that were checked. The speed of the
/// path falls as an S-curve; of the possible durations the shortest admissible one is searched in start().
///
/// Real-time safe: no allocation, no lock, no exception, bounded: start() looks at no more than 66 durations of 41 samples each.
class PathStop {
 public:
  explicit PathStop(const StopLimits& limits = {}) noexcept : limits_{limits} {}

  /// Begins a stop. The set-point of `tick` was the last one sent; a tick past the end counts as the last.
  ///
  /// @param trajectory  at least one point; must outlive the stop. Its joints keep MotionLimits that are within StopLimits.
  void start(const Trajectory& trajectory, std::size_t tick) noexcept;

  /// The set-point of the next tick. Returns whether the arm still moves; once it does not, `out` is the place of rest, again and again.
  /// Without a start() it returns false and leaves `out` as it is.
  bool step(TrajectoryPoint& out) noexcept;

  /// From the tick of start() to rest.
  Duration duration() const noexcept { return trajectory_ == nullptr ? Duration{0} : duration_ticks_ * trajectory_->tick; }
  /// Where the last set-point lies on the trajectory, in its ticks.
  double path_position() const noexcept { return position_; }

  /// Goes on along another copy of the same trajectory, as a replay has it.
  void follow(const Trajectory* copy) noexcept { trajectory_ = copy; }
  /// What it remembers, for the flight recorder: all but the limits and the trajectory itself.
  template <typename Self, typename Code>
  static void fields(Self& self, Code& code) {
    code(self.start_, self.position_, self.duration_ticks_, self.elapsed_ticks_);
  }

 private:
  bool admissible(int duration_ticks) const noexcept;

  StopLimits limits_;
  const Trajectory* trajectory_ = nullptr;
  double start_ = 0.0;     ///< path position at start(), ticks
  double position_ = 0.0;  ///< path position now, ticks
  int duration_ticks_ = 0;
  int elapsed_ticks_ = 0;
};

}  // namespace breakshot::motion
