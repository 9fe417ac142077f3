#pragma once

#include "planner/estimate/grid_belief.hpp"
#include "planner/strategy/settings.hpp"

#include <cstdint>

namespace breakshot::estimate {

/// A hit that ran, and the table before and after it.
struct ObservedHit {
  Scene before, after;
  StrokeRequest stroke;
  double contact_speed = 0.0;  ///< as the controller measured it, m/s; 0: not known, then the asked speed counts
};

struct RestitutionPrior {
  double mean = 0.8;
  double sigma = 0.10;
};

/// Learns the restitution between discs from what hits come to.
///
/// Where each disc ends hangs on micrometres, but how far all of them slide together hardly does: friction takes m mu g per metre, so the sum of
/// mass times way is the energy that the impacts left over mu g. It is compared with what the virtual world gives for the same hit over a range of
/// restitutions, in worlds drawn as uncertain as they are.
class RestitutionEstimate {
 public:
  RestitutionEstimate(const RestitutionPrior& prior, const strategy::StrategySettings& settings);

  /// Cost: some milliseconds, for a thousand rollouts.
  /// @param friction  what is believed of it now
  /// @return whether the hit said anything: it must have kept all discs, known one by one
  bool on_hit(const ObservedHit& observed, const strategy::Belief& friction, std::uint64_t seed);

  strategy::Belief belief() const noexcept { return belief_.belief(); }

 private:
  strategy::StrategySettings settings_;
  GridBelief belief_;
};

}  // namespace breakshot::estimate
