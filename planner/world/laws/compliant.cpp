#include "planner/world/laws/compliant.hpp"

#include "planner/world/contact_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::world {

namespace {

/// e of a contact that ends with its force, for a damping ratio (Schwager and Poeschel, eq. 21).
double restitution_of_damping(double zeta) noexcept {
  if (zeta < 1.0) {
    const double omega = std::sqrt(1.0 - zeta * zeta);
    const double angle = std::atan2(2.0 * zeta * omega, 1.0 - 2.0 * zeta * zeta);  // of the oscillation that is left when the force ends
    return std::exp(-zeta / omega * (std::numbers::pi - angle));
  }
  if (zeta == 1.0) return std::exp(-2.0);
  const double omega = std::sqrt(zeta * zeta - 1.0);
  return std::exp(-zeta / omega * std::log((zeta + omega) / (zeta - omega)));
}

void keep_energy(const ImpactProblem& problem, double before) noexcept {
  const double after = kinetic_energy(problem.inverse_mass, problem.v);
  if (after <= before) return;
  double mass = 0.0;
  Vector2 momentum{0.0, 0.0};
  for (std::size_t i = 0; i < problem.v.size(); ++i) {
    if (problem.inverse_mass[i] == 0.0) return;  // what is driven may give energy
    mass += 1.0 / problem.inverse_mass[i];
    momentum += problem.v[i] / problem.inverse_mass[i];
  }
  const Vector2 common = momentum / mass;
  const double of_common = 0.5 * mass * common.squaredNorm();
  const double scale = std::sqrt(std::max(0.0, before - of_common) / (after - of_common));
  for (Vector2& v : problem.v) v = common + scale * (v - common);
}

}  // namespace

double damping_ratio(double e) noexcept {
  constexpr double kMostDamping = 8.0;
  double low = 0.0, high = kMostDamping;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (restitution_of_damping(middle) > e ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void Compliant::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const {
  constexpr int kMostContacts = 100;  // one after the other
  const double dt = contact_time_ / steps_;
  const double omega = std::numbers::pi / contact_time_;
  const double quiet = quiet_speed(problem);
  const double before = kinetic_energy(problem.inverse_mass, problem.v);

  auto& depth = scratch.depth;
  auto& damping = scratch.target;
  depth.clear();
  damping.clear();
  double known_e = -1.0, known_ratio = 0.0;
  for (const ImpactContact& contact : problem.contacts) {
    if (contact.restitution != known_e) {
      known_e = contact.restitution;
      known_ratio = damping_ratio(known_e);
    }
    depth.push_back(-contact.gap);
    damping.push_back(2.0 * known_ratio * omega);
  }

  for (int step = 0; step < kMostContacts * steps_; ++step) {
    bool over = true;
    // Forces of all contacts from the same velocities: the order of the contacts does not matter.
    scratch.impulse.assign(problem.contacts.size(), 0.0);
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      const ImpactContact& contact = problem.contacts[k];
      const double approach = approach_speed(contact, problem.v);
      depth[k] += dt * approach;
      over = over && depth[k] <= 0.0 && approach <= quiet;
      if (depth[k] <= 0.0) continue;
      const double compliance =
          problem.inverse_mass[static_cast<std::size_t>(contact.a)] + problem.inverse_mass[static_cast<std::size_t>(contact.b)];
      const double force = (omega * omega * depth[k] + damping[k] * approach) / compliance;
      if (force > 0.0) {
        scratch.impulse[k] = dt * force;
      } else if (approach < 0.0) {
        depth[k] = 0.0;  // the surfaces come back more slowly than the bodies part, and are whole when they meet again
      }
    }
    if (over && step > 0) break;
    for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
      if (scratch.impulse[k] > 0.0) apply_impulse(problem, problem.contacts[k], scratch.impulse[k]);
    }
  }
  keep_energy(problem, before);
  end_without_bounce(problem, scratch);
}

}  // namespace breakshot::world
