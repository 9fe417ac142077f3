#include "planner/task/crowd.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

namespace breakshot::task {

Spacing spacing_of(const Scene& scene, std::span<const Vector2> p_WD, double min_gap) {
  Spacing spacing;
  std::vector<bool> apart(p_WD.size(), true);
  for (std::size_t i = 0; i < p_WD.size(); ++i) {
    for (std::size_t j = i + 1; j < p_WD.size(); ++j) {
      if ((p_WD[i] - p_WD[j]).norm() - scene.discs[i].radius - scene.discs[j].radius >= min_gap) continue;
      apart[i] = apart[j] = false;
      ++spacing.pairs;
    }
  }
  spacing.apart = static_cast<std::uint32_t>(std::count(apart.begin(), apart.end(), true));
  return spacing;
}

Spacing spacing_of(const Scene& scene, double min_gap) {
  std::vector<Vector2> p_WD;
  for (const SceneDisc& disc : scene.discs) p_WD.push_back(disc.p_WD);
  return spacing_of(scene, p_WD, min_gap);
}

std::uint32_t most_that_fit(const Rect& region, double radius, double min_gap) noexcept {
  const Vector2 size = region.max - region.min;
  const double d = 2.0 * radius + min_gap;
  return static_cast<std::uint32_t>(2.0 * size.prod() / (std::numbers::sqrt3 * d * d) + size.sum() / d + 1.0);
}

}  // namespace breakshot::task
