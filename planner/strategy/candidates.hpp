#pragma once

#include "planner/strategy/strategy.hpp"
#include "planner/strategy/table_model.hpp"

#include <string>
#include <vector>

namespace breakshot::strategy {

/// A stroke that has room, and what it is in words.
struct Candidate {
  StrokeRequest stroke;
  std::string what;  ///< "hit disc 3 at 0.75 m/s"
};

/// Strokes that could be made on a table: nothing about what they are worth.
///
/// Hits of every disc, in directions all around, through its centre and off it on both sides, at speeds from slow to fast. Pushes of every
/// pair below G through the middle of its gap, from both sides, along the tangent and askew, outward pushes of single discs of such pairs, and
/// pushes that bring discs back which have left the region.
/// Kept are those whose way down and run-in keep clear of other discs and inside the striker's area.
std::vector<Candidate> stroke_candidates(const TableModel& model, const DecisionContext& context, const StrategySettings& settings);

}  // namespace breakshot::strategy
