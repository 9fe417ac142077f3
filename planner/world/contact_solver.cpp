#include "planner/world/contact_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace breakshot::world {

namespace {

double largest_speed(std::span<const Vector2> v) noexcept {
  double largest = 0.0;
  for (const Vector2& one : v) largest = std::max(largest, one.norm());
  return largest;
}

}  // namespace

void solve_together(const ImpactProblem& problem, std::span<const int> contacts, std::span<const double> target,
                    std::vector<double>& impulse) {
  constexpr double kRelativeError = 1e-12;
  // Compact clusters of 50 discs need a few thousand sweeps to get there; the bound only guards against NaN.
  constexpr int kSweeps = 100'000;

  impulse.assign(contacts.size(), 0.0);
  const double scale = largest_speed(problem.v);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double largest = 0.0;
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const ImpactContact& contact = problem.contacts[static_cast<std::size_t>(contacts[k])];
      const double compliance =
          problem.inverse_mass[static_cast<std::size_t>(contact.a)] + problem.inverse_mass[static_cast<std::size_t>(contact.b)];
      const double wanted = target[k] + approach_speed(contact, problem.v);
      const double next = std::max(0.0, impulse[k] + wanted / compliance);
      const double change = next - impulse[k];
      impulse[k] = next;
      apply_impulse(problem, contact, change);
      largest = std::max(largest, std::abs(change) * compliance);
    }
    if (!(largest > kRelativeError * scale)) return;
  }
}

void end_without_bounce(const ImpactProblem& problem, ImpactScratch& scratch) {
  scratch.active.resize(problem.contacts.size());
  std::iota(scratch.active.begin(), scratch.active.end(), 0);
  scratch.target.assign(problem.contacts.size(), 0.0);
  solve_together(problem, scratch.active, scratch.target, scratch.impulse);
}

double rounding_speed(const ImpactProblem& problem) noexcept {
  constexpr double kRounding = 1e-10;  // of the largest speed
  return kRounding * largest_speed(problem.v);
}

double quiet_speed(const ImpactProblem& problem) noexcept { return std::max(problem.quiet, rounding_speed(problem)); }

}  // namespace breakshot::world
