#pragma once

#include "controller/motion/stroke_planner.hpp"
#include "planner/strategy/strategy.hpp"

namespace breakshot::planner {

/// Asks the motion library whether the arm can run a stroke from its park pose: the same question that the controller will ask, so what
/// passes here is hardly ever refused there.
class ArmFilter final : public strategy::StrokeFilter {
 public:
  /// Keeps the planner, which serves one thread at a time.
  explicit ArmFilter(motion::StrokePlanner& planner) : planner_{&planner} {}

  Result<strategy::StrokeForecast, strategy::StrokeRefusal> forecast(const StrokeRequest& stroke) override;

 private:
  motion::StrokePlanner* planner_;
};

}  // namespace breakshot::planner
