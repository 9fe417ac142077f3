#include "planner/estimate/table_estimate.hpp"

namespace breakshot::estimate {

namespace {

/// A disc that the striker drives is at most so much faster than it.
constexpr double kFasterThanPushes = 1.3;

}  // namespace

TableEstimate::TableEstimate(const EstimateSettings& settings, const strategy::StrategySettings& strategy)
    : friction_{{strategy.cell.world.friction, settings.friction_factor, settings.friction_local_spread,
                 kFasterThanPushes * strategy.rules.push_speed}},
      restitution_{{strategy.cell.world.restitution, settings.restitution_sigma}, strategy} {}

void TableEstimate::on_hit(const ObservedHit& hit) {
  Vector2 middle{0.0, 0.0};
  for (const SceneDisc& disc : hit.before.discs) middle += disc.p_WD / static_cast<double>(hit.before.discs.size());
  restitution_.on_hit(hit, friction_.belief_at(middle), ++hits_);
}

strategy::TableBelief TableEstimate::belief(const Scene& scene) const {
  Vector2 middle{0.0, 0.0};
  for (const SceneDisc& disc : scene.discs) middle += disc.p_WD / static_cast<double>(scene.discs.size());
  return {friction_.belief_at(middle), restitution_.belief(), friction_.map_around(middle)};
}

}  // namespace breakshot::estimate
