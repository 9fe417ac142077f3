#include "controller/safety/freshness.hpp"

#include <algorithm>

namespace breakshot::safety {

void FreshnessWatchdog::update(bool fresh, Time now) noexcept {
  if (fresh) {
    ticks_without_ = 0;
    last_fresh_ = now;
    if (stale_ && ++samples_ >= limits_.recover_samples) {
      stale_ = false;
      established_ = true;
    }
    return;
  }
  // Saturates: a controller may wait for its drives for days.
  ticks_without_ = std::min(ticks_without_ + 1, limits_.stop_ticks);
  if (ticks_without_ >= limits_.predict_ticks) samples_ = 0;
  if (ticks_without_ >= limits_.stop_ticks || now - last_fresh_ >= limits_.stop_after) {
    stale_ = true;
    samples_ = 0;
  }
}

}  // namespace breakshot::safety
