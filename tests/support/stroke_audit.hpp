#pragma once

#include "common/random.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "tests/support/before.hpp"

namespace breakshot::support {

/// What a planned stroke does, measured on its set-points alone: on every tick and three times between ticks, where the drives interpolate
/// (cubic Hermite, as common/joints.hpp says). Shares no code with the planner's own check. Ratios are to the limit: above 1 it is broken.
struct StrokeAudit {
  // At the contact tick of a hit; of a push: where its line begins, with the speed of its cruise.
  double position_error = 0.0;  ///< of the rod's axis from StrokeRequest::p_WS, m
  double direction_error =
      0.0;                    ///< of the tip's velocity from StrokeRequest::direction_W, table plane, rad; a push: largest while it moves
  double speed_error = 0.0;   ///< relative
  double height_error = 0.0;  ///< of the tip from MotionSettings::tip_height, m

  double line_deviation = 0.0;   ///< of the axis from the line through p_WS over the run-in or the push, m
  double end_error = 0.0;        ///< of a push's end from where its length says, m
  double run_in_height = 0.0;    ///< highest the tip is above tip_height on the run-in, m
  double corridor_breach = 0.0;  ///< furthest that the low tip is outside of the corridor of StrokeTimes, sideways or lengthways, m
  double low_outside_dip = 0.0;  ///< deepest below safe_height that the tip is away from the stroke's line, m
  double lowest_tip = 0.0;       ///< above the table, m
  double lowest_link = 0.0;      ///< above the table, m
  double struck_disc_gap = 0.0;  ///< least gap of the rod to a lone disc struck head-on, until the tip is over the disc tops, m; a push: 0
  double range = 0.0;            ///< furthest a joint is outside of its range, rad
  double speed = 0.0, acceleration = 0.0, jerk = 0.0;
  double join = 0.0;  ///< largest disagreement of a joint's speed with the change of its position, rad/s
  bool phases_in_order = true;
  bool at_rest_at_ends = true;  ///< or, at its beginning, as the stroke that it goes on from is there
};

/// @param times   what plan() said of this trajectory
/// @param before  null: it begins at rest
StrokeAudit audit(const motion::StrokePlanner& planner, const StrokeRequest& request, const motion::StrokeTimes& times,
                  const motion::Trajectory& trajectory, const Before* before = nullptr);

/// A hit with its contact point anywhere in `area`, in any direction.
StrokeRequest random_hit(SplitMix64& random, const Rect& area, double speed);
/// A push of 30 to 250 mm at 0.05 to 0.3 m/s that stays in `area`.
StrokeRequest random_push(SplitMix64& random, const Rect& area);

}  // namespace breakshot::support
