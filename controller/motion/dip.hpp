#pragma once

#include "common/geometry.hpp"
#include "common/joints.hpp"
#include "controller/motion/profiles.hpp"
#include "controller/motion/tip_tracker.hpp"

#include <vector>

namespace breakshot::motion {

/// The part of a stroke in which the tip is lower than the discs allow: down, along a straight line, up again.
///
/// Seen from above it is straight throughout. Time 0 is where the tip passes (or, for a push, sets off from) the asked point at its lowest
/// height. Before and after, the tip comes down and rises with constant vertical acceleration while it travels, so a hit dips like a pendulum and
/// never stops: it comes out of a transit, and goes into the next one, at full speed.
struct Dip {
  Vector2 p_WS{0.0, 0.0};          ///< the asked point
  Vector2 direction_W{1.0, 0.0};   ///< unit
  Vector3 axis_W{0.0, 0.0, -1.0};  ///< of the rod, tip's z
  double low = 0.0;                ///< height of the tip at time 0, m

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

/// Where the joints are and how they move.
struct MotionState {
  JointVector q, qd, qdd;

  static MotionState at_rest(const JointVector& q) { return {q, JointVector::Zero(q.size()), JointVector::Zero(q.size())}; }
  bool rests() const noexcept { return qd.isZero(0.0) && qdd.isZero(0.0); }
};

/// What dips and transits are measured against.
struct JointLimits {
  JointVector lower, upper, speed;
  double acceleration = 0.0, jerk = 0.0;
};

/// What one side of a dip asks of the joints: the largest ratios to their limits. Above 1 it is not allowed.
struct DipUse {
  double speed = 0.0, acceleration = 0.0, jerk = 0.0;
  bool reachable =
      false;        ///< false: it leads through a singular or unreachable place or out of the joints' ranges; the rest then says nothing
  MotionState end;  ///< at the far end, only when admissible

  bool admissible() const noexcept { return reachable && speed <= 1.0 && acceleration <= 1.0 && jerk <= 1.0; }
};

/// Use of a dip from time 0, where the joints are at q0, to time `to` on either side of it, sampled at least every `step` seconds.
/// Ends at the first sample that is not admissible.
DipUse use_of(const Dip& dip, const TipTracker& tracker, const JointLimits& limits, const JointVector& q0, double to, double step) noexcept;

/// A dip's states at the ticks `first` <= 0 to `last` >= 0, counted from time 0, where the joints are near q0. Returns whether the arm can follow.
/// @param tick  s
bool sample(const Dip& dip, const TipTracker& tracker, const JointVector& q0, int first, int last, double tick,
            std::vector<MotionState>& states);

}  // namespace breakshot::motion
