#pragma once

#include "common/geometry.hpp"
#include "controller/motion/profiles.hpp"
#include "controller/motion/tip_tracker.hpp"

namespace breakshot::motion {

/// The part of a stroke in which the tip is lower than the discs allow: down, along a straight line, up again.
///
/// Seen from above it is straight throughout. Time 0 is where the tip passes (or, for a push, sets off from) the asked point at its lowest
/// height. Before and after, the tip comes down and rises with constant vertical acceleration while it travels, so a hit dips like a pendulum and
/// never stops: it comes out of a transit, and goes into the next one, at full speed.
struct Dip {
  Vector2 p_WS{0.0, 0.0};         ///< the asked point
  Vector2 direction_W{1.0, 0.0};  ///< unit
  Vector3 axis_W{0.0, 0.0, -1.0}; ///< of the rod, tip's z
  double low = 0.0;               ///< height of the tip at time 0, m

  SpeedRamp run_up;               ///< horizontal, backward in time from 0
  double level = 0.0;             ///< time before 0 in which the tip is already at `low`, s
  Rise fall;                      ///< vertical, backward in time from -level
  SpeedRamp set_off, slow_down;   ///< push: ends of its line
  double cruise = 0.0;            ///< push: time between them, s
  SpeedRamp brake;                ///< horizontal, from the end of the line
  Rise rise;                      ///< vertical, from the end of the line
  double begin = 0.0, end = 0.0;  ///< where transits join, s

  /// Duration of the push's line; 0 for a hit.
  double line_time() const noexcept { return set_off.duration() + cruise + slow_down.duration(); }

  struct Tip {
    Vector3 p_WT, v_WT_W;
  };
  Tip at(double t) const noexcept;
  /// Signed way along direction_W from p_WS, m.
  double way(double t) const noexcept;
};

/// How much of the joints' limits a motion uses: the largest ratio to the limit. Above 1 it is not allowed.
struct Use {
  double speed = 0.0, acceleration = 0.0, jerk = 0.0;
  bool reachable = true;  ///< false: singular, unreachable or outside the joints' ranges; the ratios then say nothing

  double worst() const noexcept { return std::max({speed, acceleration, jerk}); }
  bool admissible() const noexcept { return reachable && worst() <= 1.0; }
};

/// What dips are measured against.
struct JointLimits {
  JointVector lower, upper, speed;
  double acceleration = 0.0, jerk = 0.0;
};

/// Use of a dip between time 0, where the joints are at q0, and time `to` on either side of it, sampled at least every `step` seconds.
/// Gives up early, with the use so far, where the dip is far from admissible.
Use use_of(const Dip& dip, const TipTracker& tracker, const JointLimits& limits, const JointVector& q0, double to, double step) noexcept;

}  // namespace breakshot::motion
