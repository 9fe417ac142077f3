#include "planner/world/contact_solver.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::world {

void solve_together(const ImpactProblem& problem, std::span<const int> contacts, std::span<const double> target,
                    std::vector<double>& impulse) {
  constexpr double kRelativeError = 1e-12;
  // Compact clusters of 50 discs need a few thousand sweeps to get there; the bound only guards against NaN.
  constexpr int kSweeps = 100'000;

  impulse.assign(contacts.size(), 0.0);
  double scale = 0.0;
  for (const Vector2& v : problem.v) scale = std::max(scale, v.norm());
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

}  // namespace breakshot::world
