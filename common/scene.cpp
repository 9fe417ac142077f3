#include "common/scene.hpp"

#include <algorithm>
#include <limits>

namespace breakshot {

const char* to_string(SceneQuality quality) noexcept {
  switch (quality) {
    case SceneQuality::kOk: return "ok";
    case SceneQuality::kDark: return "dark";
    case SceneQuality::kFrozen: return "frozen";
    case SceneQuality::kBadImage: return "bad image";
  }
  return "invalid";
}

double smallest_gap(const Scene& scene) noexcept {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scene.discs.size(); ++i) {
    for (std::size_t j = i + 1; j < scene.discs.size(); ++j) {
      const auto& a = scene.discs[i];
      const auto& b = scene.discs[j];
      smallest = std::min(smallest, (a.p_WD - b.p_WD).norm() - a.radius - b.radius);
    }
  }
  return smallest;
}

}  // namespace breakshot
