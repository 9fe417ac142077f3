#include "planner/world/pair_motion.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::world {

namespace {

/// A disc in motion against one at rest: its path is a straight line, so the place of contact is a ray test and the time a square root.
/// Valid because the mover brakes along its path (a = -k v). `relative` is the resting body's place seen from the mover.
double collision_with_resting(const Motion& mover, const Vector2& relative, double reach) noexcept {
  const double speed = mover.v.norm();
  const double deceleration = mover.a.norm();
  const Vector2 forward = mover.v / speed;
  const double ahead = relative.dot(forward);
  const double aside_squared = relative.squaredNorm() - ahead * ahead;
  if (ahead <= 0.0 || aside_squared >= reach * reach) return kNever;
  const double half_chord = std::sqrt(reach * reach - aside_squared);
  const double path = std::max(0.0, ahead - half_chord);
  // path = speed s - deceleration s^2 / 2, in the form that does not cancel when deceleration is small
  const double left = speed * speed - 2.0 * deceleration * path;
  if (left <= 0.0) return kNever;
  const double time = 2.0 * path / (speed + std::sqrt(left));
  if (time > mover.end) return kNever;
  // Once in contact the mover only slows down and passes by: a contact that is too slow now stays too slow.
  const double approach = std::sqrt(left) * std::min(half_chord, ahead) / reach;
  return approach >= kQuietApproach ? time : kNever;
}

Quartic shifted(const Quartic& c, double s) noexcept {  // Taylor shift by synthetic division
  Quartic out = c;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 4; j-- > i;) out[j] += s * out[j + 1];
  }
  return out;
}

/// A pair that touches but approaches too slowly to count, both motions being parabolas on [0, end]: when it next touches and approaches
/// fast enough. Relative motion is a parabola and its square a quartic. Rare, so that it may cost a microsecond.
double collision_of_touching(const Vector2& p, const Vector2& v, const Vector2& a, double end, double reach) noexcept {
  const Quartic apart{p.squaredNorm() - reach * reach, 2.0 * p.dot(v), v.squaredNorm() + p.dot(a), v.dot(a), 0.25 * a.squaredNorm()};
  // Above zero while the pair does not approach fast enough: kQuietApproach |p| + p . v, with |p| = reach where it matters.
  const Quartic quiet{kQuietApproach * reach + p.dot(v), apart[2], 1.5 * apart[3], 2.0 * apart[4], 0.0};
  const double slack = 2.0 * reach * kContactSlack;

  // Contact and approach alternate at most as often as the two polynomials have roots.
  double s = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Quartic from_here = s > 0.0 ? shifted(apart, s) : apart;
    if (from_here[0] > slack) {
      const double meet = first_nonpositive(from_here, end - s);
      if (meet == kNever) return kNever;
      s += meet;
    }
    if (evaluate(quiet, s) > 0.0) {
      const double fast = first_nonpositive(shifted(quiet, s), end - s);
      if (fast == kNever) return kNever;
      s += fast;
    }
    if (evaluate(apart, s) <= slack) return s;
  }
  return kNever;
}

/// The general case on one interval [0, end] in which both motions are parabolas.
///
/// The way between the centres, seen along its direction now, is a parabola too, and never longer than the way itself: up to its first root
/// the pair cannot meet. So the pair is moved on to there and looked at again, from the new direction, until it meets or the root lies
/// beyond the end. Converges like Newton's method, from one side: no meeting is passed over, however short the graze.
double collision_on_interval(Vector2 p, Vector2 v, const Vector2& a, double end, double reach) noexcept {
  constexpr double kMet = 1e-12;  // m; some thousand times the rounding of positions on a table
  // Three or four are enough for all but grazes, which take up to twenty: each halves what is left of the way.
  constexpr int kSteps = 64;
  double s = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double distance = p.norm();
    const double gap = distance - reach;
    const double closing = -p.dot(v) / distance;
    const double braking = p.dot(a) / distance;
    if (gap <= kMet) {
      if (closing >= kQuietApproach) return s;
      const double left = end - s;
      if (closing > -kQuietApproach) {
        const double meets = collision_of_touching(p, v, a, left, reach);
        return meets == kNever ? kNever : s + meets;
      }
      // Parts, as a pair that has just collided does. Along this line it can be as near again at the parabola's other root, and not before.
      if (2.0 * closing <= braking * left) return kNever;
      const double step = 2.0 * closing / braking;
      s += step;
      p += step * (v + 0.5 * step * a);
      v += step * a;
      continue;
    }
    const double radicand = closing * closing - 2.0 * braking * gap;
    if (radicand < 0.0) return kNever;
    const double nearing = closing + std::sqrt(radicand);
    if (nearing * (end - s) < 2.0 * gap) return kNever;
    const double step = 2.0 * gap / nearing;
    s += step;
    p += step * (v + 0.5 * step * a);
    v += step * a;
  }
  return kNever;
}

/// The motion from `s` on, s <= end.
Motion later(const Motion& m, double s) noexcept {
  if (!(m.end > s)) return {m.p + m.end * (m.v + 0.5 * m.end * m.a), {0.0, 0.0}, {0.0, 0.0}, 0.0, true};
  return {m.p + s * (m.v + 0.5 * s * m.a), m.v + s * m.a, m.a, m.end - s, m.rests_after};
}

}  // namespace

double next_collision(const Motion& a, const Motion& b, double reach) noexcept {
  const bool a_moves = a.end > 0.0;
  const bool b_moves = b.end > 0.0;
  if (!a_moves && !b_moves) return kNever;
  if (!b_moves && a.rests_after) return collision_with_resting(a, b.p - a.p, reach);
  if (!a_moves && b.rests_after) return collision_with_resting(b, a.p - b.p, reach);

  // A body at rest has neither velocity nor deceleration here, whatever its motion says.
  const double end = std::min(a_moves ? a.end : kNever, b_moves ? b.end : kNever);
  const Vector2 v = (b_moves ? b.v : Vector2{0.0, 0.0}) - (a_moves ? a.v : Vector2{0.0, 0.0});
  const Vector2 deceleration = (b_moves ? b.a : Vector2{0.0, 0.0}) - (a_moves ? a.a : Vector2{0.0, 0.0});
  const double found = collision_on_interval(b.p - a.p, v, deceleration, end, reach);
  if (found != kNever) return found;
  const bool unknown_beyond = (a_moves && !a.rests_after && a.end <= end) || (b_moves && !b.rests_after && b.end <= end);
  if (unknown_beyond) return kNever;

  // One came to rest; the other goes on.
  const double rest = next_collision(a_moves ? later(a, end) : a, b_moves ? later(b, end) : b, reach);
  return rest == kNever ? kNever : end + rest;
}

}  // namespace breakshot::world
