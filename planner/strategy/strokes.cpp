#include "planner/strategy/strokes.hpp"

#include <algorithm>

namespace breakshot::strategy {

StrokeRequest hit_stroke(const Vector2& p_WS, const Vector2& direction_W, double speed, const StrokeRules& rules) {
  StrokeRequest stroke;
  stroke.kind = StrokeKind::kHit;
  stroke.p_WS = p_WS;
  stroke.direction_W = direction_W;
  stroke.run_in = rules.hit_run_in;
  stroke.speed = speed;
  return stroke;
}

StrokeRequest push_stroke(const Vector2& p_WS, const Vector2& direction_W, double length, const StrokeRules& rules) {
  StrokeRequest stroke;
  stroke.kind = StrokeKind::kPush;
  stroke.p_WS = p_WS;
  stroke.direction_W = direction_W;
  stroke.speed = rules.push_speed;
  stroke.length = length;
  return stroke;
}

Vector2 low_from(const StrokeRequest& hit, const CellKnowledge& cell) {
  return hit.p_WS - std::max(hit.run_in, cell.hit_fall * hit.speed) * hit.direction_W;
}

world::StrikerRun striker_run(const StrokeRequest& stroke, const CellKnowledge& cell) {
  world::StrikerRun run;
  const bool hit = stroke.kind == StrokeKind::kHit;
  run.cruise = hit ? stroke.run_in : stroke.length;
  run.p_WS = stroke.p_WS - (hit ? stroke.run_in : 0.0) * stroke.direction_W;
  run.direction = stroke.direction_W;
  run.speed = stroke.speed;
  run.braking = cell.hit_braking;
  run.lift = cell.hit_lift;
  run.radius = cell.striker_radius;
  run.mobility = Matrix2::Identity() / cell.striker_mass;
  run.bandwidth = cell.drive_bandwidth;
  return run;
}

void follow_through(world::StrikerRun& run, const StrokeRequest& hit, const StrokeForecast& forecast) {
  if (!(forecast.low_time > 0.0)) return;
  // The deceleration that takes the striker as far as the arm says in the time that it says.
  run.lift = forecast.low_time;
  run.braking = std::max(0.01, 2.0 * (hit.speed * run.lift - forecast.low_after) / (run.lift * run.lift));
}

}  // namespace breakshot::strategy
