#pragma once

#include "planner/strategy/settings.hpp"
#include "planner/world/disc.hpp"

#include <optional>
#include <span>

namespace breakshot::strategy {

/// Distance from a point to the segment from `from` to `to`, m.
double distance_to_segment(const Vector2& p, const Vector2& from, const Vector2& to) noexcept;

/// Whether the striker, on its way along a segment, keeps `margin` from every disc but `except` (a scene index, or none).
bool way_is_free(std::span<const world::Disc> discs, const Vector2& from, const Vector2& to, double striker_radius, double margin,
                 std::optional<std::size_t> except = std::nullopt) noexcept;

/// Whether the striker's axis stays where it may be, all along a segment.
bool way_is_inside(const Rect& area, const Vector2& from, const Vector2& to) noexcept;

/// Striker's axis when it touches a disc that it hits along `direction` through the disc's centre.
Vector2 central_contact(const world::Disc& disc, const Vector2& direction, double striker_radius) noexcept;

/// Where a push along `direction` through `through` can begin: the striker's axis as near as the margin to discs a and b allows. Nothing
/// when another disc is nearer to that place than the margin.
std::optional<Vector2> push_start_at_pair(std::span<const world::Disc> discs, std::size_t a, std::size_t b, const Vector2& through,
                                          const Vector2& direction, double striker_radius, double margin) noexcept;

/// The same for a push that need not come from the pair's own side: the nearest place on the line, backwards from `through`, at which the
/// striker keeps the margin to every disc.
Vector2 push_start_in_open(std::span<const world::Disc> discs, const Vector2& through, const Vector2& direction, double striker_radius,
                           double margin) noexcept;

/// How far the striker's axis runs along `direction` from `from` until it touches the first disc, and which one; nothing when it meets none.
struct FirstMet {
  std::size_t disc = 0;
  double way = 0.0;  ///< m
};
std::optional<FirstMet> first_met(std::span<const world::Disc> discs, const Vector2& from, const Vector2& direction,
                                  double striker_radius) noexcept;

}  // namespace breakshot::strategy
