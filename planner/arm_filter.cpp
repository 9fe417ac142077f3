#include "planner/arm_filter.hpp"

namespace breakshot::planner {

std::optional<strategy::StrokeRefusal> ArmFilter::refusal(const StrokeRequest& stroke) {
  StrokeRequest numbered = stroke;
  if (numbered.id == 0) numbered.id = 1;  // strategies leave it to the task; the planner of strokes insists on one
  const auto times = planner_->estimate(numbered, planner_->settings().park);
  if (times) return std::nullopt;
  return strategy::StrokeRefusal{times.error().reason, times.error().text};
}

}  // namespace breakshot::planner
