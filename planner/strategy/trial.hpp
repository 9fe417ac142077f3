#pragma once

#include "planner/strategy/strategy.hpp"
#include "planner/strategy/table_model.hpp"
#include "planner/world/quasi_static_push.hpp"

#include <vector>

namespace breakshot::strategy {

/// What a stroke comes to in the virtual world.
struct TrialResult {
  std::vector<Vector2> p_WD;  ///< by scene index
  double smallest_gap = 0.0;  ///< m
  int pairs_below = 0;        ///< with a gap below G
  double border = 0.0;        ///< smallest distance of a disc's centre to the region's border, m; negative outside
};

/// Tries strokes in the one virtual world that the prior knowledge describes. Keeps buffers: one per thread.
class Trial {
 public:
  explicit Trial(const CellKnowledge& cell);

  /// Runs a hit in VirtualWorld or a push in QuasiStaticPush; nothing, and why, when the world refuses it.
  std::optional<TrialResult> run(const TableModel& model, const StrokeRequest& stroke, const DecisionContext& context,
                                 std::string& why_not);

 private:
  CellKnowledge cell_;
  world::VirtualWorld world_;
  world::QuasiStaticPush push_;
};

}  // namespace breakshot::strategy
