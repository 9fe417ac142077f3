#include "planner/strategy/sampled_worlds.hpp"

#include "planner/strategy/strokes.hpp"

#include "common/random.hpp"
#include "planner/world/formation.hpp"
#include "planner/world/laws/compliant.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace breakshot::strategy {

namespace {

constexpr double kLeastFriction = 0.01;
/// Contacts that last are looked into in the last round alone: a rollout takes some twenty times as long with them.
constexpr std::size_t kFirstCompliant = 16;
/// And about so many discs at most: their groups grow, and of more no one hit is the last, so that their order matters less.
constexpr std::size_t kMostCompliant = 10;
/// Steps of their integration: e is right to 1 %, which is less than is known of it.
constexpr int kContactSteps = 32;
/// Discs are loaded at the same time where their gaps are below the contact time times this, m/s: what hits and what they strike move with.
constexpr double kApproach = 0.6;
/// Friction varies from place to place in the worlds of the last round alone: a rollout takes a half longer with it.
constexpr std::size_t kFirstMapped = 16;

}  // namespace

TableBelief prior_belief(const StrategySettings& settings) noexcept {
  const auto& world = settings.cell.world;
  const auto& robust = settings.robust;
  return {{world.friction, robust.friction_spread * world.friction / std::sqrt(3.0)},
          {world.restitution, robust.restitution_spread / std::sqrt(3.0)}};
}

SampledWorlds::SampledWorlds(const TableModel& model, const Scene& scene, const DecisionContext& context, const StrategySettings& settings)
    : model_{model}, scene_{scene}, context_{context}, settings_{settings}, sequential_{world::make_impact_law("sequential")} {}

std::shared_ptr<const world::ImpactLaw> SampledWorlds::draw_law(std::size_t world, SplitMix64& random,
                                                                world::WorldSettings& physics) const {
  const auto& robust = settings_.robust;
  // Drawn in any case, so that the rest of the draw does not depend on it.
  const double which = random.uniform();
  const double contact_time = robust.contact_time_min * std::pow(robust.contact_time_max / robust.contact_time_min, random.uniform());
  const auto worlds = static_cast<double>(robust.worlds);
  const double share = robust.compliant_share * worlds / std::max(1.0, worlds - kFirstCompliant);
  if (world < kFirstCompliant || which >= share || model_.discs.size() > kMostCompliant) return sequential_;
  physics.touch_gap = std::clamp(contact_time * kApproach, physics.touch_gap, 1e-3);
  return std::make_shared<world::Compliant>(contact_time, kContactSteps);
}

SampledWorlds::Draw SampledWorlds::draw(std::size_t world) const {
  const auto& robust = settings_.robust;
  const auto& cell = settings_.cell;
  SplitMix64 random{context_.seed + 0x632BE59BD9B4E019U * world};
  const double width = world == 0 ? 0.0 : 1.0;
  world::WorldSettings physics = cell.world;
  physics.touch_gap = world::WorldSettings{}.touch_gap;
  physics.allowed_overlap = kNoiseOverlap;
  const TableBelief belief = context_.belief.value_or(prior_belief(settings_));
  const auto drawn = [&](double sigma) { return width * sigma * random.uniform(-std::sqrt(3.0), std::sqrt(3.0)); };
  // By its logarithm: a mu that is hardly known at all is as likely half as much as twice.
  physics.friction = std::max(kLeastFriction, belief.friction.mean * std::exp(drawn(belief.friction.sigma / belief.friction.mean)));
  if (world >= kFirstMapped) physics.friction_map = belief.friction_map;
  physics.restitution = std::clamp(belief.restitution.mean + drawn(belief.restitution.sigma), 0.0, 1.0);
  const double striker_e = width * random.uniform(-robust.restitution_spread, robust.restitution_spread);
  physics.striker_restitution = std::clamp(physics.striker_restitution + striker_e, 0.0, 1.0);
  const auto of_striker = [&] { return 1.0 + width * random.uniform(-robust.striker_spread, robust.striker_spread); };
  physics.striker_bounce_speed *= of_striker();
  const double mass_factor = of_striker(), bandwidth_factor = of_striker();
  const auto law = draw_law(world, random, physics);

  Draw draw{model_.discs,
            world::VirtualWorld{physics, law},
            mass_factor,
            bandwidth_factor,
            1.0 + width * random.uniform(-robust.speed_spread, robust.speed_spread),
            Eigen::Rotation2Dd{width * random.uniform(-robust.aim_spread, robust.aim_spread)}};
  for (std::size_t i = 0; i < draw.discs.size(); ++i) {
    const Matrix2 covariance = scene_.discs[i].covariance + robust.position_sigma * robust.position_sigma * Matrix2::Identity();
    const Vector2 noise{random.normal(), random.normal()};
    draw.discs[i].p_WD += width * Vector2{covariance.llt().matrixL() * noise};
    draw.discs[i].radius += width * scene_.discs[i].radius_sigma * random.normal();
  }
  world::part_overlaps(draw.discs);
  return draw;
}

Aftermath SampledWorlds::run(const StrokeRequest& stroke, const StrokeForecast& forecast, std::size_t world) {
  while (draws_.size() <= world) draws_.push_back(draw(draws_.size()));
  Draw& draw = draws_[world];

  const bool hit = stroke.kind == StrokeKind::kHit;
  StrokeRequest played = stroke;
  played.direction_W = draw.aim * stroke.direction_W;
  if (hit) played.speed *= draw.speed_factor;
  world::StrikerRun run = striker_run(played, settings_.cell);
  run.mobility /= draw.mass_factor;
  run.bandwidth *= draw.bandwidth_factor;
  if (hit) follow_through(run, stroke, forecast);

  Aftermath aftermath;
  if (hit) {
    const auto rollout = draw.world.run(draw.discs, &run);
    if (!rollout || rollout->status != world::Rollout::Status::kAtRest) return aftermath;
    aftermath.p_WD = rollout->p_WD;
  } else {
    const auto p_WD = push_.run(draw.discs, run, stroke.length, kNoiseOverlap);
    if (!p_WD) return aftermath;
    aftermath.p_WD = *p_WD;
  }
  aftermath.valid = true;
  judge(draw, aftermath);
  return aftermath;
}

void SampledWorlds::judge(const Draw& draw, Aftermath& aftermath) const {
  const double wanted = context_.min_gap + settings_.robust.gap_margin;
  const double edge_width = settings_.robust.edge_width;
  aftermath.smallest_gap = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < aftermath.p_WD.size(); ++i) {
    const double margin = context_.region.margin(aftermath.p_WD[i]);
    aftermath.outside += margin < 0.0 ? 1 : 0;
    aftermath.edge += std::clamp(1.0 - margin / edge_width, 0.0, 1.0);
    for (std::size_t j = 0; j < i; ++j) {
      const double gap = (aftermath.p_WD[i] - aftermath.p_WD[j]).norm() - draw.discs[i].radius - draw.discs[j].radius;
      aftermath.smallest_gap = std::min(aftermath.smallest_gap, gap);
      aftermath.pairs_below += gap < wanted ? 1 : 0;
    }
  }
}

}  // namespace breakshot::strategy
