#include "planner/task/scene_change.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <vector>

namespace breakshot::task {

namespace {

/// Standard deviation of an exact place, m, so that nothing is divided by zero.
constexpr double kExact = 1e-6;

}  // namespace

double in_sigmas(const Vector2& difference, const Matrix2& covariance) noexcept {
  const Matrix2 inverse = (covariance + kExact * kExact * Matrix2::Identity()).inverse();
  return std::sqrt(std::max(0.0, difference.dot(inverse * difference)));
}

SceneChange change_between(const Scene& before, const Scene& after, double min_gap, double floor) {
  SceneChange change;
  const std::size_t n = before.discs.size();
  if (after.discs.size() != n) return change;
  std::vector<std::size_t> now_at(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto same = [&](const SceneDisc& disc) { return disc.id == before.discs[i].id; };
    const auto found = std::find_if(after.discs.begin(), after.discs.end(), same);
    if (found == after.discs.end() || std::count_if(after.discs.begin(), after.discs.end(), same) != 1) return change;
    now_at[i] = static_cast<std::size_t>(found - after.discs.begin());
  }
  change.same_discs = change.same_order = change.same_pairs = true;
  for (std::size_t i = 0; i < n; ++i) {
    const SceneDisc& was = before.discs[i];
    const SceneDisc& is = after.discs[now_at[i]];
    change.same_order = change.same_order && now_at[i] == i;
    const Vector2 moved = is.p_WD - was.p_WD;
    const Matrix2 covariance = was.covariance + is.covariance + 2.0 * floor * floor * Matrix2::Identity();
    change.furthest = std::max(change.furthest, moved.norm());
    change.in_sigmas = std::max(change.in_sigmas, task::in_sigmas(moved, covariance));
    for (std::size_t j = 0; j < i; ++j) {
      const bool was_close = gap_between(was, before.discs[j]).mean < min_gap;
      const bool is_close = gap_between(is, after.discs[now_at[j]]).mean < min_gap;
      change.same_pairs = change.same_pairs && was_close == is_close;
    }
  }
  return change;
}

}  // namespace breakshot::task
