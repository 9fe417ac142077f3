#include "planner/strategy/trial.hpp"

#include "planner/strategy/strokes.hpp"

#include <algorithm>
#include <limits>

namespace breakshot::strategy {

Trial::Trial(const CellKnowledge& cell) : cell_{cell}, world_{cell.world, world::make_impact_law(cell.impact_law)} {}

std::optional<TrialResult> Trial::run(const TableModel& model, const StrokeRequest& stroke, const DecisionContext& context,
                                      std::string& why_not) {
  TrialResult result;
  const world::StrikerRun run = striker_run(stroke, cell_);
  if (stroke.kind == StrokeKind::kHit) {
    const auto rollout = world_.run(model.discs, &run);
    if (!rollout) {
      why_not = rollout.error().text;
      return std::nullopt;
    }
    if (rollout->status != world::Rollout::Status::kAtRest) {
      why_not = "impact law " + std::string{world_.law().name()} + " cannot carry the virtual world to rest";
      return std::nullopt;
    }
    result.p_WD.assign(rollout->p_WD.begin(), rollout->p_WD.end());
  } else {
    const auto p_WD = push_.run(model.discs, run, stroke.length);
    if (!p_WD) {
      why_not = p_WD.error().text;
      return std::nullopt;
    }
    result.p_WD.assign(p_WD->begin(), p_WD->end());
  }

  result.smallest_gap = std::numeric_limits<double>::infinity();
  result.border = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < result.p_WD.size(); ++i) {
    result.border = std::min(result.border, context.region.margin(result.p_WD[i]));
    for (std::size_t j = 0; j < i; ++j) {
      const double gap = (result.p_WD[i] - result.p_WD[j]).norm() - model.discs[i].radius - model.discs[j].radius;
      result.smallest_gap = std::min(result.smallest_gap, gap);
      result.pairs_below += gap < context.min_gap ? 1 : 0;
    }
  }
  return result;
}

}  // namespace breakshot::strategy
