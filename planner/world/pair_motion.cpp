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

/// Whether the way between the centres, seen along its present direction, stays above `reach` on [0, end]: it is then too long as a whole.
/// A parabola's least value, and most pairs of a break are ruled out by it.
bool stays_apart(double distance, double along_v, double along_a, double end, double reach) noexcept {
  double least = std::min(distance, distance + end * (along_v + 0.5 * end * along_a));
  if (along_v < 0.0 && along_a > 0.0 && -along_v < along_a * end) least = distance - 0.5 * along_v * along_v / along_a;
  return least > reach;
}

Quartic shifted(const Quartic& c, double s) noexcept {  // Taylor shift by synthetic division
  Quartic out = c;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 4; j-- > i;) out[j] += s * out[j + 1];
  }
  return out;
}

/// The general case on one interval [0, end] in which both motions are parabolas: relative motion is one, and its square a quartic.
double collision_on_interval(const Vector2& p, const Vector2& v, const Vector2& a, double distance, double end, double reach) noexcept {
  const double p_v = p.dot(v);
  const double p_a = p.dot(a);
  if (stays_apart(distance, p_v / distance, p_a / distance, end, reach)) return kNever;
  const Quartic apart{(distance - reach) * (distance + reach), 2.0 * p_v, v.squaredNorm() + p_a, v.dot(a), 0.25 * a.squaredNorm()};
  // Above zero while the pair does not approach fast enough: kQuietApproach |p| + p . v, with |p| = reach where it matters.
  const Quartic quiet{kQuietApproach * reach + p_v, apart[2], 1.5 * apart[3], 2.0 * apart[4], 0.0};
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

}  // namespace

double next_collision(const Motion& a, const Motion& b, double reach) noexcept {
  const Vector2 p = b.p - a.p;
  const bool a_moves = a.end > 0.0;
  const bool b_moves = b.end > 0.0;
  if (!a_moves && !b_moves) return kNever;
  // Nobody travels further than its speed lasts: speed * end bounds every path that does not speed up.
  const double distance = p.norm();
  const double speed_a = a_moves ? a.v.norm() : 0.0;
  const double speed_b = b_moves ? b.v.norm() : 0.0;
  if (distance - reach > speed_a * a.end + speed_b * b.end) return kNever;

  if (!b_moves && a.rests_after) return collision_with_resting(a, p, reach);
  if (!a_moves && b.rests_after) return collision_with_resting(b, -p, reach);

  const double unknown = std::min(a.rests_after ? kNever : a.end, b.rests_after ? kNever : b.end);
  const double first_end = std::min({a_moves ? a.end : kNever, b_moves ? b.end : kNever, unknown});
  const Vector2 dv = (b_moves ? b.v : Vector2{0.0, 0.0}) - (a_moves ? a.v : Vector2{0.0, 0.0});
  const Vector2 da = (b_moves ? b.a : Vector2{0.0, 0.0}) - (a_moves ? a.a : Vector2{0.0, 0.0});
  const double found = collision_on_interval(p, dv, da, distance, first_end, reach);
  if (found != kNever) return found;
  if (first_end >= unknown) return kNever;

  // One came to rest; the other goes on.
  const auto later = [first_end](const Motion& m) {
    if (!(m.end > first_end)) {
      return Motion{m.p + m.end * (m.v + 0.5 * m.end * m.a), {0.0, 0.0}, {0.0, 0.0}, 0.0, true};
    }
    return Motion{m.p + first_end * (m.v + 0.5 * first_end * m.a), m.v + first_end * m.a, m.a, m.end - first_end, m.rests_after};
  };
  const Motion a_later = a_moves ? later(a) : a;
  const Motion b_later = b_moves ? later(b) : b;
  const double rest = next_collision(a_later, b_later, reach);
  return rest == kNever ? kNever : first_end + rest;
}

}  // namespace breakshot::world
