#pragma once

#include "planner/strategy/candidates.hpp"
#include "planner/strategy/sampled_worlds.hpp"

#include <string>
#include <vector>

namespace breakshot::strategy {

/// Tries many strokes in many worlds that could be the real one and takes the one that is expected to finish soonest.
///
/// All candidates are tried in a few worlds, the better part of them in more, and so on (successive rejection, Karnin, Koren and Somekh 2013),
/// until a handful has been tried in all worlds. The arm is asked about these alone. The cost of a stroke in a world is its own time, the
/// expected time of what it leaves, and a price for discs that leave the region or come to rest at its border. docs/strategies.md says why so.
class RobustStrategy final : public Strategy {
 public:
  explicit RobustStrategy(const StrategySettings& settings) : settings_{settings} {}
  std::string_view name() const noexcept override { return "robust"; }
  Decision decide(const Scene& scene, const DecisionContext& context) override { return choose(scene, context, {}); }
  /// Tries the earlier strokes and what is next to them in direction, contact point and speed, with a small part of the budget.
  Decision revise(const Scene& scene, const DecisionContext& context, std::span<const StrokeOption> earlier) override {
    return choose(scene, context, earlier);
  }

 private:
  /// @param earlier  not empty: only strokes near one of these
  Decision choose(const Scene& scene, const DecisionContext& context, std::span<const StrokeOption> earlier);
  /// A candidate and what came of it so far.
  struct Scored {
    Candidate candidate;
    StrokeForecast forecast;
    std::size_t worlds = 0;
    double cost = 0.0;  ///< sum over the worlds, s
    int singulated = 0;
    int lost = 0;       ///< worlds in which a disc ends outside the region
    int lost_more = 0;  ///< worlds in which more discs do than before
    double mean() const noexcept { return cost / static_cast<double>(worlds); }
  };

  double stroke_time(const Scored& one) const noexcept;
  /// Expected time to finish when so many pairs are below G, s.
  double rest_time(std::size_t pairs) const noexcept;
  double cost_of(const Scored& one, const Aftermath& aftermath) const noexcept;
  void try_in_worlds(Scored& one, SampledWorlds& worlds, std::size_t up_to) const;
  /// @param rollout_cost  of a rollout of so many discs, in those of the budget
  void reject_successively(std::vector<Scored>& all, SampledWorlds& worlds, double rollout_cost) const;
  void ask_arm(std::vector<Scored>& all, SampledWorlds& worlds, StrokeFilter& arm, std::string& refusal) const;
  StrokeOption option_of(const Scored& one, SampledWorlds& worlds) const;

  StrategySettings settings_;
  std::stop_token stop_;  ///< of the decision at hand
  int outside_now_ = 0;   ///< discs outside the region in the scene at hand
};

}  // namespace breakshot::strategy
