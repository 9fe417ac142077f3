#pragma once

#include "planner/world/disc.hpp"

#include <algorithm>
#include <vector>

namespace breakshot::test {

/// Where discs come to rest, by a plain integration of the virtual world's physics; for discs that meet one at a time.
///
/// @param deceleration  of a disc at a place, m/s^2
/// @param step          s
template <typename Deceleration>
std::vector<Vector2> integrated(std::vector<world::Disc> discs, const Deceleration& deceleration, double e, double step) {
  bool moving = true;
  while (moving) {
    moving = false;
    for (auto& disc : discs) {
      const double speed = disc.v_WD_W.norm();
      if (speed == 0.0) continue;
      moving = true;
      const double a = deceleration(disc.p_WD);
      const double left = std::max(0.0, speed - a * step);
      disc.p_WD += 0.5 * (speed + left) * std::min(step, speed / a) / speed * disc.v_WD_W;
      disc.v_WD_W *= left / speed;
    }
    for (std::size_t i = 0; i < discs.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (gap(discs[i], discs[j]) > 0.0) continue;
        const Vector2 n = (discs[j].p_WD - discs[i].p_WD).normalized();
        const double u = (discs[i].v_WD_W - discs[j].v_WD_W).dot(n);
        if (u <= 0.0) continue;
        const double P = (1 + e) * u / (1 / discs[i].mass + 1 / discs[j].mass);
        discs[i].v_WD_W -= P / discs[i].mass * n;
        discs[j].v_WD_W += P / discs[j].mass * n;
      }
    }
  }
  std::vector<Vector2> rest;
  for (const auto& disc : discs) rest.push_back(disc.p_WD);
  return rest;
}

}  // namespace breakshot::test
