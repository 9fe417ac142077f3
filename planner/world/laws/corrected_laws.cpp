#include "planner/world/laws/corrected_laws.hpp"

#include "planner/world/contact_solver.hpp"

#include <algorithm>

namespace breakshot::world {

namespace {

/// Solves rounds of contacts together until none approaches. With `all`, those that merely touch take part.
void solve_in_rounds(const ImpactProblem& problem, ImpactScratch& scratch, bool all) {
  // Racks of 21 discs take about 20 rounds for e >= 0.2.
  constexpr int kRounds = 64;
  const double rounding = rounding_speed(problem);
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
  const double quiet = quiet_speed(problem);
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
