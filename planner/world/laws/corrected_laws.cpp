#include "planner/world/laws/corrected_laws.hpp"

#include "planner/world/contact_solver.hpp"

#include <algorithm>

namespace breakshot::world {

namespace {

/// Solves rounds of contacts together until none approaches. With `all`, those that merely touch take part; `elastic` puts e = 1 in place of
/// the contacts' own.
void solve_in_rounds(const ImpactProblem& problem, ImpactScratch& scratch, bool all, bool elastic = false) {
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
      scratch.target.push_back((elastic ? 1.0 : problem.contacts[k].restitution) * std::max(0.0, approach));
    }
    if (!any_approaches) return;
    solve_together(problem, scratch.active, scratch.target, scratch.impulse);
  }
  end_without_bounce(problem, scratch);
}

}  // namespace

void PaperCorrected::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const { solve_in_rounds(problem, scratch, false); }

void Simultaneous::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const { solve_in_rounds(problem, scratch, true); }

void GeneralisedReflections::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const {
  double e = 0.0;
  for (const ImpactContact& contact : problem.contacts) e += contact.restitution / static_cast<double>(problem.contacts.size());
  scratch.v_before.assign(problem.v.begin(), problem.v.end());
  if (e < 1.0) end_without_bounce(problem, scratch);
  scratch.v_plastic.assign(problem.v.begin(), problem.v.end());
  if (e == 0.0) return;
  std::copy(scratch.v_before.begin(), scratch.v_before.end(), problem.v.begin());
  solve_in_rounds(problem, scratch, false, true);
  for (std::size_t i = 0; i < problem.v.size(); ++i) problem.v[i] = e * problem.v[i] + (1.0 - e) * scratch.v_plastic[i];
}

void Sequential::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const { solve_in_rounds(problem, scratch, false); }

}  // namespace breakshot::world
