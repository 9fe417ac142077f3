#pragma once

#include "planner/strategy/hybrid_strategy.hpp"

namespace breakshot::strategy {

/// The paper's direction-based strategy: hits by central or simultaneous impact, pushes along common tangents, both from the side nearer to
/// the arm.
class PaperStrategy final : public HybridStrategy {
 public:
  explicit PaperStrategy(const StrategySettings& settings) : HybridStrategy{settings} {}
  std::string_view name() const noexcept override { return "paper"; }

 protected:
  bool hits() const noexcept override { return true; }
  std::vector<HitAim> hit_aims(const TableModel& model, int cluster, const DecisionContext& context) const override;
  std::vector<PushAim> push_aims(const TableModel& model, const DecisionContext& context) const override;
  bool weighs_pushes() const noexcept override { return true; }
};

}  // namespace breakshot::strategy
