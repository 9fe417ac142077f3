#include "planner/world/polynomial.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::world {

namespace {

constexpr int kDegree = 4;
/// Halvings after which an interval (2^-50 of the whole) counts as a point.
constexpr int kDepth = 50;

struct Interval {
  Quartic b;         // Bernstein coefficients
  double low, high;  // as fractions of [0, end]
  int depth;
};

double slope(const Quartic& c, double s) noexcept { return c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * 4.0 * c[4])); }

/// The root in [low, high], where the polynomial is above zero at low and not above it at high.
double close_in(const Quartic& c, double low, double high) noexcept {
  double s = 0.5 * (low + high);
  for (int i = 0; i < 100; ++i) {
    const double value = evaluate(c, s);
    (value > 0.0 ? low : high) = s;
    const double rise = slope(c, s);
    double next = rise < 0.0 ? s - value / rise : low;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - s) <= 1e-16 * high || next == low || next == high) return next;
    s = next;
  }
  return s;
}

}  // namespace

double evaluate(const Quartic& c, double s) noexcept { return c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * c[4]))); }

double first_nonpositive(const Quartic& c, double end) noexcept {
  if (c[0] <= 0.0) return 0.0;
  // Power basis on [0, end] to Bernstein basis: b_i = sum_j (C(i,j) / C(4,j)) c_j end^j.
  Quartic a = c;
  double power = end;
  for (std::size_t j = 1; j <= kDegree; ++j, power *= end) a[j] *= power;
  const Interval whole{{a[0], a[0] + a[1] / 4.0, a[0] + a[1] / 2.0 + a[2] / 6.0, a[0] + 0.75 * a[1] + a[2] / 2.0 + a[3] / 4.0,
                        a[0] + a[1] + a[2] + a[3] + a[4]},
                       0.0,
                       1.0,
                       0};

  std::array<Interval, kDepth + 2> stack;
  std::size_t size = 0;
  stack[size++] = whole;
  while (size > 0) {
    const Interval now = stack[--size];
    const auto& b = now.b;
    if (b[0] <= 0.0) return now.low * end;
    int changes = 0;
    for (std::size_t i = 1; i <= kDegree; ++i) changes += (b[i - 1] > 0.0) != (b[i] > 0.0) ? 1 : 0;
    if (changes == 0) continue;
    if (changes == 1) return close_in(c, now.low * end, now.high * end);
    if (now.depth == kDepth) return now.low * end;  // touches zero without crossing it, to rounding

    // de Casteljau at the middle; the left part is looked at first.
    Quartic left, right = b;
    left[0] = right[0];
    for (std::size_t level = 1; level <= kDegree; ++level) {
      for (std::size_t i = 0; i + level <= kDegree; ++i) right[i] = 0.5 * (right[i] + right[i + 1]);
      left[level] = right[0];
    }
    const double middle = 0.5 * (now.low + now.high);
    stack[size++] = {right, middle, now.high, now.depth + 1};
    stack[size++] = {left, now.low, middle, now.depth + 1};
  }
  return kNever;
}

}  // namespace breakshot::world
