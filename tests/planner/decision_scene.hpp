#pragma once

#include "planner/strategy/strategy.hpp"
#include "tests/planner/table_sim.hpp"

#include <vector>

namespace breakshot::test {

/// Discs as perception would report them. @param noise  of their places, standard deviation, m
inline Scene scene_of(const std::vector<Disc>& discs, double noise = 1e-9) {
  TableTruth truth;
  truth.position_noise = noise;
  return TableSim{discs, truth, 1}.scene();
}

/// An order that fits the cell, with strokes left.
inline strategy::DecisionContext decision_context() {
  strategy::DecisionContext context;
  context.region = {{-0.3, -0.3}, {0.3, 0.3}};
  context.hits_left = 3;
  context.pushes_left = 10;
  return context;
}

}  // namespace breakshot::test
