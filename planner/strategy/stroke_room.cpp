#include "planner/strategy/stroke_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace breakshot::strategy {

double distance_to_segment(const Vector2& p, const Vector2& from, const Vector2& to) noexcept {
  const Vector2 way = to - from;
  const double squared = way.squaredNorm();
  const double part = squared > 0.0 ? std::clamp((p - from).dot(way) / squared, 0.0, 1.0) : 0.0;
  return (p - from - part * way).norm();
}

bool way_is_free(std::span<const world::Disc> discs, const Vector2& from, const Vector2& to, double striker_radius, double margin,
                 std::optional<std::size_t> except) noexcept {
  for (std::size_t i = 0; i < discs.size(); ++i) {
    if (except == i) continue;
    if (distance_to_segment(discs[i].p_WD, from, to) < discs[i].radius + striker_radius + margin) return false;
  }
  return true;
}

bool way_is_inside(const Rect& area, const Vector2& from, const Vector2& to) noexcept { return area.contains(from) && area.contains(to); }

Vector2 central_contact(const world::Disc& disc, const Vector2& direction, double striker_radius) noexcept {
  return disc.p_WD - (disc.radius + striker_radius) * direction;
}

namespace {

/// Way back from `through` against `direction` beyond which the striker keeps the margin to a disc; -infinity when it always does.
double way_clear_of(const world::Disc& disc, const Vector2& through, const Vector2& direction, double striker_radius,
                    double margin) noexcept {
  const Vector2 p = disc.p_WD - through;
  const double back = -p.dot(direction);
  const double reach = disc.radius + striker_radius + margin;
  const double aside_squared = p.squaredNorm() - back * back;
  return aside_squared < reach * reach ? back + std::sqrt(reach * reach - aside_squared) : -std::numeric_limits<double>::infinity();
}

/// Slack of comparisons with a margin that a place was computed to keep exactly, m.
constexpr double kRounding = 1e-9;

}  // namespace

std::optional<Vector2> push_start_at_pair(std::span<const world::Disc> discs, std::size_t a, std::size_t b, const Vector2& through,
                                          const Vector2& direction, double striker_radius, double margin) noexcept {
  const double back = std::max({0.0, way_clear_of(discs[a], through, direction, striker_radius, margin),
                                way_clear_of(discs[b], through, direction, striker_radius, margin)});
  const Vector2 start = through - back * direction;
  if (!way_is_free(discs, start, start, striker_radius, margin - kRounding)) return std::nullopt;
  return start;
}

Vector2 push_start_in_open(std::span<const world::Disc> discs, const Vector2& through, const Vector2& direction, double striker_radius,
                           double margin) noexcept {
  double back = 0.0;
  // Going back past one disc may end within the margin of the next; each disc is passed once at most.
  for (std::size_t round = 0; round < discs.size(); ++round) {
    bool moved = false;
    for (const world::Disc& disc : discs) {
      const double reach = disc.radius + striker_radius + margin - kRounding;
      if ((disc.p_WD - through + back * direction).squaredNorm() >= reach * reach) continue;
      back = way_clear_of(disc, through, direction, striker_radius, margin);
      moved = true;
    }
    if (!moved) break;
  }
  return through - back * direction;
}

std::optional<FirstMet> first_met(std::span<const world::Disc> discs, const Vector2& from, const Vector2& direction,
                                  double striker_radius) noexcept {
  std::optional<FirstMet> first;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const Vector2 p = discs[i].p_WD - from;
    const double ahead = p.dot(direction);
    const double reach = discs[i].radius + striker_radius;
    const double aside_squared = p.squaredNorm() - ahead * ahead;
    if (ahead <= 0.0 || aside_squared >= reach * reach) continue;
    const double way = ahead - std::sqrt(reach * reach - aside_squared);
    if (way >= 0.0 && (!first || way < first->way)) first = FirstMet{i, way};
  }
  return first;
}

}  // namespace breakshot::strategy
