#include "planner/world/laws/corrected_laws.hpp"

#include "planner/world/contact_solver.hpp"

#include <algorithm>
#include <numeric>

namespace breakshot::world {

namespace {

/// Approach speeds below this part of the largest speed count as rounding.
constexpr double kRounding = 1e-10;

double largest_speed(std::span<const Vector2> v) noexcept {
  double largest = 0.0;
  for (const Vector2& one : v) largest = std::max(largest, one.norm());
  return largest;
}

/// All contacts together with e = 0: afterwards none approaches, and energy has only gone down.
void end_without_bounce(const ImpactProblem& problem, ImpactScratch& scratch) {
  scratch.active.resize(problem.contacts.size());
  std::iota(scratch.active.begin(), scratch.active.end(), 0);
  scratch.target.assign(problem.contacts.size(), 0.0);
  solve_together(problem, scratch.active, scratch.target, scratch.impulse);
}

/// Solves rounds of contacts together until none approaches. With `all`, those that merely touch take part.
void solve_in_rounds(const ImpactProblem& problem, ImpactScratch& scratch, bool all) {
  // Racks of 21 discs take about 20 rounds for e >= 0.2.
  constexpr int kRounds = 64;
  const double rounding = kRounding * largest_speed(problem.v);
  const double quiet = std::max(problem.quiet, rounding);
  const double from = all ? -rounding : quiet;
  for (int round = 0; round < kRounds; ++round) {
    scratch.active.clear();
    scratch.target.clear();
    bool any_approaches = false;
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const double approach = approach_speed(problem.contacts[k], problem.v);
      if (approach <= from) continue;
      any_approaches = any_approaches || approach > quiet;
      scratch.active.push_back(static_cast<int>(k));
      scratch.target.push_back(problem.contacts[k].restitution * std::max(0.0, approach));
    }
    if (!any_approaches) return;
    solve_together(problem, scratch.active, scratch.target, scratch.impulse);
  }
  end_without_bounce(problem, scratch);
}

}  // namespace

void PaperCorrected::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const { solve_in_rounds(problem, scratch, false); }

void Simultaneous::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const { solve_in_rounds(problem, scratch, true); }

void Sequential::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const {
  constexpr int kSweeps = 1000;
  const double quiet = std::max(problem.quiet, kRounding * largest_speed(problem.v));
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    bool any = false;
    for (const ImpactContact& contact : problem.contacts) {
      const double approach = approach_speed(contact, problem.v);
      if (approach <= quiet) continue;
      any = true;
      const double compliance =
          problem.inverse_mass[static_cast<std::size_t>(contact.a)] + problem.inverse_mass[static_cast<std::size_t>(contact.b)];
      apply_impulse(problem, contact, (1.0 + contact.restitution) * approach / compliance);
    }
    if (!any) return;
  }
  end_without_bounce(problem, scratch);
}

}  // namespace breakshot::world
