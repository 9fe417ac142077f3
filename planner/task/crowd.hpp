#pragma once

#include "common/geometry.hpp"
#include "common/scene.hpp"

#include <cstdint>
#include <span>

namespace breakshot::task {

/// How far a table is from being singulated, where not all discs can stand apart.
struct Spacing {
  std::uint32_t apart = 0;  ///< discs that keep the gap to every other one
  std::uint32_t pairs = 0;  ///< below the gap
  /// More stand apart, or as many and fewer pairs are left.
  bool better_than(const Spacing& other) const noexcept { return apart != other.apart ? apart > other.apart : pairs < other.pairs; }
};

/// @param p_WD     of the scene's discs, by its indices
/// @param min_gap  G, m
Spacing spacing_of(const Scene& scene, std::span<const Vector2> p_WD, double min_gap);
/// The same where the scene shows them.
Spacing spacing_of(const Scene& scene, double min_gap);

/// No more discs than this can have their centres in a region and every gap at least `min_gap`: an upper bound, so fewer may fit.
///
/// Points no two of which are nearer than d: 2 A / (sqrt(3) d^2) + P / (2 d) + 1 at most in a convex region of area A and perimeter P (Oler 1961, "An
/// inequality in the geometry of numbers"). Discs of unequal size count as so many of the smallest.
///
/// @param radius  of the smallest disc, m
std::uint32_t most_that_fit(const Rect& region, double radius, double min_gap) noexcept;

}  // namespace breakshot::task
