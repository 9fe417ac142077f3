#include "controller/motion/path_derivatives.hpp"

#include <algorithm>

namespace breakshot::motion {

void path_at(const Trajectory& trajectory, double position, PathDerivatives& out) noexcept {
  const std::size_t last = trajectory.size - 1;
  const std::size_t i = std::min(static_cast<std::size_t>(position), last);
  const std::size_t next = std::min(i + 1, last);
  const double h = to_seconds(trajectory.tick);
  const double x = std::clamp(position - static_cast<double>(i), 0.0, 1.0);
  const TrajectoryPoint& a = trajectory.points[i];
  const TrajectoryPoint& b = trajectory.points[next];
  out.phase = a.phase;
  for (std::size_t j = 0; j < static_cast<std::size_t>(trajectory.joints); ++j) {
    if (i == next) {  // past the end: at rest
      out.q[j] = a.q[j];
      out.d1[j] = out.d2[j] = out.d3[j] = 0.0;
      continue;
    }
    // Cubic Hermite for the position; speed and acceleration follow the trajectory's own samples.
    const double x2 = x * x;
    const double x3 = x2 * x;
    out.q[j] = (2 * x3 - 3 * x2 + 1) * a.q[j] + (x3 - 2 * x2 + x) * h * a.qd[j] + (3 * x2 - 2 * x3) * b.q[j] + (x3 - x2) * h * b.qd[j];
    out.d3[j] = (b.qdd[j] - a.qdd[j]) / h;
    out.d2[j] = a.qdd[j] + x * h * out.d3[j];
    // Integral of d2, with what the samples disagree by (their own rounding) spread over the tick.
    const double rest = b.qd[j] - a.qd[j] - 0.5 * h * (a.qdd[j] + b.qdd[j]);
    out.d1[j] = a.qd[j] + x * h * a.qdd[j] + 0.5 * x2 * h * h * out.d3[j] + x * rest;
  }
}

}  // namespace breakshot::motion
