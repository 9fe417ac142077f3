#include "planner/strategy/strategy.hpp"

#include "planner/strategy/paper_strategy.hpp"
#include "planner/strategy/random_strategy.hpp"
#include "planner/strategy/robust_strategy.hpp"

#include <stdexcept>

namespace breakshot::strategy {

std::vector<std::string> strategy_names() { return {"paper", "random_hybrid", "random_push", "robust"}; }

std::unique_ptr<Strategy> make_strategy(std::string_view name, const StrategySettings& settings) {
  if (name == "paper") return std::make_unique<PaperStrategy>(settings);
  if (name == "random_hybrid") return std::make_unique<RandomStrategy>(settings, RandomStrategy::Kind::kHybrid);
  if (name == "random_push") return std::make_unique<RandomStrategy>(settings, RandomStrategy::Kind::kPushOnly);
  if (name == "robust") return std::make_unique<RobustStrategy>(settings);
  throw std::invalid_argument("strategy: found \"" + std::string{name} + "\"; allowed: paper, random_hybrid, random_push, robust");
}

}  // namespace breakshot::strategy
