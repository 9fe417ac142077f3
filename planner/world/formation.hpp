#pragma once

#include "planner/world/disc.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace breakshot::world {

/// What is wrong with discs as the start of a rollout (not finite, radius or mass not above zero, a pair that overlaps by more than
/// allowed_overlap), for people; nothing when they will do.
std::optional<std::string> check_formation(std::span<const Disc> discs, double allowed_overlap);

/// The same for a striker among them.
std::optional<std::string> check_striker(std::span<const Disc> discs, const StrikerRun& striker, double allowed_overlap);

/// Moves discs apart until none overlaps by more than 1 nm: what noise of perception makes of discs that touch. Each pair gives way by
/// half, so no disc moves further than the overlaps around it add up to.
///
/// @return the deepest overlap that there was, m; 0 when there was none
double part_overlaps(std::vector<Disc>& discs);

}  // namespace breakshot::world
