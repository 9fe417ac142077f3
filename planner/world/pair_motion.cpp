#include "planner/world/pair_motion.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::world {

namespace {

/// A disc in motion against one at rest: its path is a straight line, so the place of contact is a ray test and the time a square root.
/// Valid because the mover brakes along its path, to rest at its end. `relative` is the resting body's place seen from the mover.
double collision_with_resting(const Motion& mover, const Vector2& relative, double reach) noexcept {
  // Ways are times the speed, which saves finding it.
  const double speed_squared = mover.v.squaredNorm();
  const double ahead = relative.dot(mover.v);
  const double aside = relative.x() * mover.v.y() - relative.y() * mover.v.x();
  const double chord_squared = reach * reach * speed_squared - aside * aside;
  if (ahead <= 0.0 || chord_squared <= 0.0) return kNever;
  const double half_chord = std::sqrt(chord_squared);
  // The time that the way would take without braking; with it, that is t - t^2 / (2 end).
  const double unbraked = std::max(0.0, ahead - half_chord) / speed_squared;
  const double slowed = 1.0 - 2.0 * unbraked / mover.end;  // the square of the speed then, relative
  if (slowed <= 0.0) return kNever;
  const double factor = std::sqrt(slowed);
  // Once in contact the mover only slows down and passes by: a contact that is too slow now stays too slow.
  return factor * std::min(half_chord, ahead) >= kQuietApproach * reach ? 2.0 * unbraked / (1.0 + factor) : kNever;
}

/// How long a pair that touches but approaches too slowly to count stays so at least, both motions being parabolas for the time `left`.
///
/// The approach speed times the distance, -p . v, grows at the rate -(v^2 + p . a), which is never above -p . a, and p . a along the way is a
/// parabola with a minimum.
double stays_quiet(const Vector2& p, const Vector2& v, const Vector2& a, double left) noexcept {
  const double a_squared = a.squaredNorm();
  if (a_squared == 0.0) return kNever;
  const double turns = std::clamp(-v.dot(a) / a_squared, 0.0, left);
  const double most = -(p.dot(a) + turns * (v.dot(a) + 0.5 * turns * a_squared));
  return most > 0.0 ? (kQuietApproach * p.norm() + p.dot(v)) / most : kNever;
}

/// The general case on one interval [0, end] in which both motions are parabolas.
///
/// The way between the centres, seen along its direction now, is a parabola too, and never longer than the way itself: up to its first root
/// the pair cannot meet. So the pair is moved on to there and looked at again, from the new direction, until it meets or the root lies
/// beyond the end. Converges like Newton's method, from one side: no meeting is passed over, however short the graze. None is before `from`.
double collision_on_interval(Vector2 p, Vector2 v, const Vector2& a, double end, double reach, double from) noexcept {
  constexpr double kMet = 1e-12;  // m; some thousand times the rounding of positions on a table
  // Three or four are enough for all but grazes, which take up to twenty: each halves what is left of the way.
  constexpr int kSteps = 256;
  // A pair that touches is looked at so often at most, s: in that time its approach grows by a twentieth of kQuietApproach.
  constexpr double kLeastStep = 1e-5;
  double s = 0.0;
  double step = from;
  for (int i = 0; i < kSteps; ++i) {
    s += step;
    p += step * (v + 0.5 * step * a);
    v += step * a;
    // What follows is along the line of centres and times the distance, which saves dividing by it.
    const double squared = p.squaredNorm();
    const double distance = std::sqrt(squared);
    const double closing = -p.dot(v);
    const double braking = p.dot(a);
    if (distance - reach <= kMet) {
      if (closing >= kQuietApproach * distance) return s;
      const double left = end - s;
      if (closing > -kQuietApproach * distance) {
        step = std::max(kLeastStep, stays_quiet(p, v, a, left));
        if (step >= left) return kNever;
        continue;
      }
      // Parts, as a pair that has just collided does. Along this line it can be as near again at the parabola's other root, and not before.
      if (2.0 * closing <= braking * left) return kNever;
      step = 2.0 * closing / braking;
      continue;
    }
    const double gap = squared - reach * distance;
    const double radicand = closing * closing - 2.0 * braking * gap;
    if (radicand < 0.0) return kNever;
    const double nearing = closing + std::sqrt(radicand);
    if (nearing * (end - s) < 2.0 * gap) return kNever;
    step = 2.0 * gap / nearing;
  }
  return kNever;
}

/// The motion from `s` on, s <= end.
Motion later(const Motion& m, double s) noexcept {
  if (!(m.end > s)) return {m.p + m.end * (m.v + 0.5 * m.end * m.a), {0.0, 0.0}, {0.0, 0.0}, 0.0, true};
  return {m.p + s * (m.v + 0.5 * s * m.a), m.v + s * m.a, m.a, m.end - s, m.rests_after};
}

}  // namespace

double next_collision(const Motion& a, const Motion& b, double reach, double from) noexcept {
  const bool a_moves = a.end > 0.0;
  const bool b_moves = b.end > 0.0;
  if (!a_moves && !b_moves) return kNever;
  if (!b_moves && a.rests_after) return collision_with_resting(a, b.p - a.p, reach);
  if (!a_moves && b.rests_after) return collision_with_resting(b, a.p - b.p, reach);

  // A body at rest has neither velocity nor deceleration here, whatever its motion says.
  const double end = std::min(a_moves ? a.end : kNever, b_moves ? b.end : kNever);
  const Vector2 v = (b_moves ? b.v : Vector2{0.0, 0.0}) - (a_moves ? a.v : Vector2{0.0, 0.0});
  const Vector2 deceleration = (b_moves ? b.a : Vector2{0.0, 0.0}) - (a_moves ? a.a : Vector2{0.0, 0.0});
  if (from < end) {
    const double found = collision_on_interval(b.p - a.p, v, deceleration, end, reach, from);
    if (found != kNever) return found;
  }
  const bool unknown_beyond = (a_moves && !a.rests_after && a.end <= end) || (b_moves && !b.rests_after && b.end <= end);
  if (unknown_beyond) return kNever;

  // One came to rest; the other goes on.
  const double rest = next_collision(a_moves ? later(a, end) : a, b_moves ? later(b, end) : b, reach);
  return rest == kNever ? kNever : end + rest;
}

}  // namespace breakshot::world
