#pragma once

#include "common/stroke.hpp"
#include "planner/strategy/settings.hpp"
#include "planner/strategy/strategy.hpp"

namespace breakshot::strategy {

/// A hit that passes p_WS (the striker's axis at the contact, m) along the unit vector direction_W at `speed`, with the run-in of the rules.
StrokeRequest hit_stroke(const Vector2& p_WS, const Vector2& direction_W, double speed, const StrokeRules& rules);

/// A push from p_WS along the unit vector direction_W over `length`, m, at the speed of the rules.
StrokeRequest push_stroke(const Vector2& p_WS, const Vector2& direction_W, double length, const StrokeRules& rules);

/// Where a hit's striker is first as low as the discs: on its run-in, or before that on its way down.
Vector2 low_from(const StrokeRequest& hit, const CellKnowledge& cell);

/// The striker as the virtual world moves it in a stroke, by what the cell is known to do.
world::StrikerRun striker_run(const StrokeRequest& stroke, const CellKnowledge& cell);

/// What the arm says that it does after the contact of a hit, in the place of what is known of all hits; zeros: it says nothing.
void follow_through(world::StrikerRun& run, const StrokeRequest& hit, const StrokeForecast& forecast);

}  // namespace breakshot::strategy
