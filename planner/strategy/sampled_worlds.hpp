#pragma once

#include "common/random.hpp"
#include "planner/strategy/strategy.hpp"
#include "planner/strategy/table_model.hpp"
#include "planner/world/quasi_static_push.hpp"

#include <vector>

namespace breakshot::strategy {

/// What is believed before anything was learnt: the settings' half widths as standard deviations (of an even distribution, its half width over the
/// root of 3).
TableBelief prior_belief(const StrategySettings& settings) noexcept;

/// What a stroke leaves behind in one world.
struct Aftermath {
  bool valid = false;             ///< the world could run the stroke; else it says nothing
  int pairs_below = 0;            ///< with a gap below G and the margin for perception
  int outside = 0;                ///< discs that left the region
  double edge = 0.0;              ///< sum over discs of how near they are to the region's border: 0 beyond edge_width, 1 on it
  double smallest_gap = 0.0;      ///< m
  std::span<const Vector2> p_WD;  ///< until the next run
};

/// Worlds that could all be the one on the table: positions and radii as uncertain as perception says, friction and restitution as uncertain as what has
/// been learnt of them (or else RobustRules) says; speed, aim, striker and impact law as RobustRules say. World 0 is the one that is believed most. The same worlds serve all strokes, so that strokes are compared on equal
/// terms. Worlds are drawn as they are asked for; the seed says which.
class SampledWorlds {
 public:
  SampledWorlds(const TableModel& model, const Scene& scene, const DecisionContext& context, const StrategySettings& settings);

  /// Runs a stroke in a world. A hit goes on after the contact as the arm's forecast says, if it says.
  Aftermath run(const StrokeRequest& stroke, const StrokeForecast& forecast, std::size_t world);

 private:
  struct Draw {
    std::vector<world::Disc> discs;
    world::VirtualWorld world;
    double mass_factor, bandwidth_factor, speed_factor;
    Eigen::Rotation2Dd aim;
  };
  Draw draw(std::size_t world) const;
  std::shared_ptr<const world::ImpactLaw> draw_law(std::size_t world, SplitMix64& random, world::WorldSettings& physics) const;
  void judge(const Draw& draw, Aftermath& aftermath) const;

  const TableModel& model_;
  const Scene& scene_;
  const DecisionContext& context_;
  const StrategySettings& settings_;
  std::shared_ptr<const world::ImpactLaw> sequential_;
  std::vector<Draw> draws_;
  world::QuasiStaticPush push_;
};

}  // namespace breakshot::strategy
