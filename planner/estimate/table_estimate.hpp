#pragma once

#include "planner/estimate/friction_estimate.hpp"
#include "planner/estimate/restitution_estimate.hpp"

namespace breakshot::estimate {

struct EstimateSettings {
  double friction_factor = 1.15;        ///< FrictionPrior::factor
  double friction_local_spread = 0.05;  ///< FrictionPrior::local_spread
  double restitution_sigma = 0.03;      ///< RestitutionPrior::sigma
};

/// What the planner learns of its table, over all strokes of its life: friction from discs that slide, restitution from what hits come to.
/// Begins with the prior knowledge of the settings. One thread at a time.
class TableEstimate {
 public:
  TableEstimate(const EstimateSettings& settings, const strategy::StrategySettings& strategy);

  /// Every scene of the stream, at rest or in motion.
  void on_scene(const Scene& scene) { friction_.on_scene(scene); }
  void on_hit(const ObservedHit& hit);

  /// What a decision about this scene may count on: friction where its discs are, and around them.
  strategy::TableBelief belief(const Scene& scene) const;

  const FrictionEstimate& friction() const noexcept { return friction_; }
  const RestitutionEstimate& restitution() const noexcept { return restitution_; }

 private:
  FrictionEstimate friction_;
  RestitutionEstimate restitution_;
  std::uint64_t hits_ = 0;
};

}  // namespace breakshot::estimate
