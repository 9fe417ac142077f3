#pragma once

#include "common/geometry.hpp"

#include <limits>

namespace breakshot::world {

inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// A body between two events: p + v s + a s^2 / 2 until s = end, s being the time from now.
struct Motion {
  Vector2 p{0.0, 0.0};
  Vector2 v{0.0, 0.0};
  Vector2 a{0.0, 0.0};
  double end = 0.0;         ///< s; 0 for a body at rest
  bool rests_after = true;  ///< at rest from `end` on; else nothing is known beyond it, and a pair is followed no further
};

/// Contacts that approach more slowly than this are let be until they do approach so fast, m/s.
///
/// Two touching discs that slide side by side are pressed together, because friction acts along each one's own velocity; with impacts alone
/// they would collide infinitely often. Below this speed such a pair may sink into each other instead: by at most kQuietApproach^2 /
/// (4 mu g) ~ 0.1 um at a time and (1 - e) kQuietApproach / 2 ~ 0.1 mm per second of rubbing. Unlike a floor on the separation speed it
/// adds no energy, and since every impact costs some, it bounds their number. 1e-3 m/s: physics.md 1 found rest positions unchanged by
/// floors up to there.
inline constexpr double kQuietApproach = 1e-3;

/// Discs nearer than this touch: rounding leaves a pair that has just met within far less, m.
inline constexpr double kContactSlack = 1e-9;

/// When two bodies next collide: the first time from now at which their centres are `reach` apart or less and approach at
/// kQuietApproach or faster; kNever when that does not happen before both rest (or one's motion ends unknown).
///
/// @param from  a time before which the two are known not to collide, s; saves the way there
///
/// Exact to 1e-12 m; no collision is missed however short the graze. No allocation; 10 to 100 ns.
double next_collision(const Motion& a, const Motion& b, double reach, double from = 0.0) noexcept;

}  // namespace breakshot::world
