#pragma once

#include <array>
#include <limits>

namespace breakshot::world {

/// c[0] + c[1] s + ... + c[4] s^4.
using Quartic = std::array<double, 5>;

inline constexpr double kNever = std::numeric_limits<double>::infinity();

double evaluate(const Quartic& c, double s) noexcept;

/// The first s in [0, end] at which the polynomial is zero or below; kNever when it stays above zero.
///
/// In Bernstein form the polynomial lies inside the hull of its coefficients: an interval whose coefficients are all positive has no root,
/// one whose coefficients change sign once has exactly one. Intervals are halved, left part first, until one of the two holds, so that no
/// root is ever passed over (G. Farin, Curves and Surfaces for CAGD, ch. 5); the root itself is then closed in by Newton steps that a
/// bisection safeguards. Exact to rounding. Coefficients must be finite, end >= 0. No allocation; about 50 ns without a root.
double first_nonpositive(const Quartic& c, double end) noexcept;

}  // namespace breakshot::world
