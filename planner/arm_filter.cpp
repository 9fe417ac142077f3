#include "planner/arm_filter.hpp"

namespace breakshot::planner {

Result<strategy::StrokeForecast, strategy::StrokeRefusal> ArmFilter::forecast(const StrokeRequest& stroke) {
  StrokeRequest numbered = stroke;
  if (numbered.id == 0) numbered.id = 1;  // strategies leave it to the task; the planner of strokes insists on one
  const auto times = planner_->estimate(numbered, planner_->settings().park);
  if (!times) return strategy::StrokeRefusal{times.error().reason, times.error().text};
  return strategy::StrokeForecast{to_seconds(times->total), times->low_after, to_seconds(times->low_time)};
}

}  // namespace breakshot::planner
