#include "common/scene.hpp"

#include "common/gap.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

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

const char* to_string(ForeignObject::Kind kind) noexcept {
  switch (kind) {
    case ForeignObject::Kind::kPaint: return "a coloured patch that is no disc";
    case ForeignObject::Kind::kHeight: return "something that stands up from the table";
    case ForeignObject::Kind::kOffTable: return "a disc that does not lie on the table, or something on it";
  }
  return "invalid";
}

std::string describe(const ForeignObject& object) {
  char text[160];
  std::snprintf(text, sizeof text, "%s at (%.3f, %.3f) m, about %.0f mm across", to_string(object.kind), object.p_W.x(), object.p_W.y(),
                2e3 * object.extent);
  std::string all = text;
  if (object.height > 0.0) {
    std::snprintf(text, sizeof text, ", %.0f mm high", 1e3 * object.height);
    all += text;
  }
  return all;
}

SceneGap gap_between(const SceneDisc& a, const SceneDisc& b) noexcept {
  const Vector2 way = b.p_WD - a.p_WD;
  const Vector2 n_AB = way.norm() > 0.0 ? Vector2{way.normalized()} : Vector2{1.0, 0.0};
  const double variance =
      n_AB.dot((a.covariance + b.covariance) * n_AB) + a.radius_sigma * a.radius_sigma + b.radius_sigma * b.radius_sigma;
  return {way.norm() - a.radius - b.radius, std::sqrt(std::max(0.0, variance))};
}

double smallest_gap(const Scene& scene) noexcept { return smallest_gap_between(scene.discs); }

}  // namespace breakshot
