#pragma once

#include "planner/world/disc.hpp"

#include <cstddef>

namespace breakshot::world {

/// Where the striker goes: along its run, off it when a disc that it strikes throws it back, and onto it again as its drives make good for that.
///
/// What an impact takes of its speed is missing at once, while the drives need some milliseconds: a disc that stops at its neighbour and is met again
/// in between is met by a slower striker. Drives that are critically damped with the bandwidth w bring a place x and a speed v off the run to
/// (x + (v + w x) t) exp(-w t). Bodies move in straight lines, so the way back is cut into a few of them, with its true places at their ends.
class StrikerMotion {
 public:
  /// A straight piece of the way.
  struct Leg {
    Vector2 v{0.0, 0.0};             ///< m/s
    Vector2 deceleration{0.0, 0.0};  ///< along v, m/s^2
    double until = 0.0;              ///< the leg ends then, s; kNever: the striker is not among the discs any more
  };

  /// Begins a run at time 0.
  void begin(const StrikerRun& run) noexcept;

  /// The leg that begins at `time`: the start, the end of the last leg, or when a disc was struck.
  /// @param p_WS  where the striker is then, m
  Leg leg(double time, const Vector2& p_WS) noexcept;

  /// An impact at `time` changed the striker's velocity. @return whether that makes a difference to its way
  bool throw_back(double time, const Vector2& p_WS, const Vector2& change_W) noexcept;

 private:
  struct Off {
    Vector2 p{0.0, 0.0}, v{0.0, 0.0};
  };
  Off off_run(double time) const noexcept;
  Vector2 on_run(double time) const noexcept;
  double speed(double time) const noexcept;

  StrikerRun run_;
  double brakes_at_ = 0.0;
  double gone_at_ = 0.0;

  std::size_t piece_ = 0;  // of the way back
  double thrown_at_ = 0.0;
  Off thrown_;  // off the run then
};

}  // namespace breakshot::world
