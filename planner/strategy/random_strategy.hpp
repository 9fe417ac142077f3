#pragma once

#include "planner/strategy/hybrid_strategy.hpp"

namespace breakshot::strategy {

/// The paper's baselines (Sec. 6): the same strokes, rules and limits as `paper`, but the direction of each is drawn at random.
class RandomStrategy final : public HybridStrategy {
 public:
  enum class Kind { kHybrid, kPushOnly };
  RandomStrategy(const StrategySettings& settings, Kind kind) : HybridStrategy{settings}, kind_{kind} {}
  std::string_view name() const noexcept override { return kind_ == Kind::kHybrid ? "random_hybrid" : "random_push"; }

 protected:
  bool hits() const noexcept override { return kind_ == Kind::kHybrid; }
  std::vector<HitAim> hit_aims(const TableModel& model, int cluster, const DecisionContext& context) const override;
  std::vector<PushAim> push_aims(const TableModel& model, const DecisionContext& context) const override;
  bool weighs_pushes() const noexcept override { return false; }

 private:
  Kind kind_;
};

}  // namespace breakshot::strategy
