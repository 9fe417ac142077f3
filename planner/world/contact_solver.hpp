#pragma once

#include "planner/world/impact_law.hpp"

namespace breakshot::world {

/// Finds the impulses of some contacts together and applies them: the complementarity problem
///
///   0 <= P,   0 <= w - target,   P . (w - target) = 0
///
/// where w is the separation speed of each contact afterwards. A contact only pushes, parts at no less than its target speed, and gets
/// nothing when the others already part it faster (errata.md, row (11)-(13)).
///
/// Projected Gauss-Seidel, to 1e-12 of the largest approach speed; it converges for every frictionless contact set, redundant ones
/// included, since the velocities (not the impulses) are unique then.
///
/// @param contacts  indices into problem.contacts of those that take part
/// @param target    separation speed of each of them, m/s, in the same order
void solve_together(const ImpactProblem& problem, std::span<const int> contacts, std::span<const double> target,
                    std::vector<double>& impulse);

/// All contacts together with e = 0: afterwards none approaches, and energy has only gone down.
void end_without_bounce(const ImpactProblem& problem, ImpactScratch& scratch);

/// Approach speeds below this count as rounding, m/s.
double rounding_speed(const ImpactProblem& problem) noexcept;
/// Contacts that approach no faster than this are let be, m/s.
double quiet_speed(const ImpactProblem& problem) noexcept;

}  // namespace breakshot::world
