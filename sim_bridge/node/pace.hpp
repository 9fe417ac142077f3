#pragma once

#include "common/time.hpp"

#include <chrono>
#include <cstdint>

namespace breakshot::sim_bridge {

/// What the physics thread does when it wakes in real-time mode.
struct Pace {
  std::int64_t ticks = 0;  ///< to run now
  Duration slip{};         ///< by which the world's clock jumps ahead first, because catching up would take too long
};

/// A drive's hardware does not stop when a process does not get its turn, so a world that woke late makes up for the ticks that it missed - up to
/// `most`. Beyond that it lets the time go: nothing moved, and the commander sees it by the stamps.
constexpr Pace pace(Time world, Time wall, Duration tick, std::int64_t most) noexcept {
  const std::int64_t behind = wall > world ? (wall - world) / tick : 0;
  return behind <= most ? Pace{behind, Duration::zero()} : Pace{most, (behind - most) * tick};
}

/// Most ticks that are made up for at once.
inline constexpr std::int64_t kMostCatchUp = 50;

}  // namespace breakshot::sim_bridge
