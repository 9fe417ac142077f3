#include "tests/bench/path_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace breakshot::bench {
namespace {

struct Range {
  double low, high;
};

/// Accelerations u of the path that keep every joint's at path speed squared x; nothing when there is none.
std::optional<Range> accelerations(const JointVector& dq, const JointVector& ddq, double x, double limit) {
  Range range{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (Eigen::Index i = 0; i < dq.size(); ++i) {
    const double taken = ddq[i] * x;
    if (std::abs(dq[i]) < 1e-9) {
      if (std::abs(taken) > limit) return std::nullopt;
      continue;
    }
    const double a = (-limit - taken) / dq[i];
    const double b = (limit - taken) / dq[i];
    range.low = std::max(range.low, std::min(a, b));
    range.high = std::min(range.high, std::max(a, b));
  }
  if (range.low > range.high) return std::nullopt;
  return range;
}

}  // namespace

double least_path_time(const JointPath& path, const JointVector& max_speed, double max_acceleration, double speed) {
  const std::size_t n = path.dq.size() - 1;
  // x: path speed squared. Backward: the most from which the rest of the path can still be kept (the set begins at 0 along gentle paths).
  std::vector<double> most(n + 1, 0.0);
  for (std::size_t k = n; k-- > 0;) {
    const double by_speed = (max_speed.array() / path.dq[k].array().abs().max(1e-9)).minCoeff();
    const auto controllable = [&](double x) {
      const auto u = accelerations(path.dq[k], path.ddq[k], x, max_acceleration);
      return u && x + 2.0 * path.step * u->low <= most[k + 1];
    };
    double high = std::min(by_speed * by_speed, speed * speed);
    if (!controllable(high)) {
      double low = 0.0;
      for (int i = 0; i < 60; ++i) (controllable(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
      high = low;
    }
    most[k] = high;
  }
  // Forward: as fast as that allows.
  double x = 0.0;
  double time = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const auto u = accelerations(path.dq[k], path.ddq[k], x, max_acceleration);
    if (!u) return 0.0;
    const double next = std::clamp(x + 2.0 * path.step * u->high, 0.0, most[k + 1]);
    if (x + next <= 0.0) return 0.0;
    time += 2.0 * path.step / (std::sqrt(x) + std::sqrt(next));
    x = next;
  }
  return time;
}

}  // namespace breakshot::bench
