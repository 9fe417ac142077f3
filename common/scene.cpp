#include "common/scene.hpp"

#include "common/gap.hpp"

namespace breakshot {

const char* to_string(SceneQuality quality) noexcept {
  switch (quality) {
    case SceneQuality::kOk: return "ok";
    case SceneQuality::kDark: return "dark";
    case SceneQuality::kFrozen: return "frozen";
    case SceneQuality::kBadImage: return "bad image";
    case SceneQuality::kMisplaced: return "misplaced";
  }
  return "invalid";
}

double smallest_gap(const Scene& scene) noexcept { return smallest_gap_between(scene.discs); }

}  // namespace breakshot
