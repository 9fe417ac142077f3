#include "planner/world/laws/paper_laws.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <array>

namespace breakshot::world {

namespace {

/// Discs of equal size have at most six neighbours; unequal ones are cut off here.
constexpr int kMaxAhead = 8;

/// One disc ahead of the striking one.
struct Ahead {
  int disc = 0;
  Vector2 n{1.0, 0.0};  ///< from the striking disc to it
  double restitution = 0.0;
};

/// Discs ahead of one striking disc.
struct Fan {
  std::array<Ahead, kMaxAhead> ahead;
  int size = 0;
};

using Impulses = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxAhead, 1>;
using Influence = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxAhead, kMaxAhead>;

/// Solves (1), (3), (4) for the impulses on the discs ahead. `v_i` enters only through its components along the normals, and `seen` maps
/// it to what (9), (10) take for it: itself, or its mirror image as printed.
Impulses solve_fan(const Fan& fan, const Vector2& v_i, double inverse_mass_i, std::span<const double> inverse_mass,
                   std::span<const Vector2> v, const Matrix2& seen) {
  Influence A(fan.size, fan.size);
  Impulses u(fan.size);
  for (int r = 0; r < fan.size; ++r) {
    const Ahead& j = fan.ahead[static_cast<std::size_t>(r)];
    const auto disc = static_cast<std::size_t>(j.disc);
    // (4): v_j'.n - v_i'.n = e (v_i.n - v_j.n), with v_j' = v_j + P_j n_j / m_j (3) and v_i' = v_i - sum(P n) / m_i (1)
    u[r] = (1.0 + j.restitution) * ((seen * v_i).dot(j.n) - v[disc].dot(j.n));
    for (int c = 0; c < fan.size; ++c) {
      A(r, c) = inverse_mass_i * j.n.dot(seen * fan.ahead[static_cast<std::size_t>(c)].n) + (r == c ? inverse_mass[disc] : 0.0);
    }
  }
  return A.fullPivLu().solve(u);
}

}  // namespace

void PaperPropagation::resolve(const ImpactProblem& problem, ImpactScratch& scratch) const {
  const auto bodies = problem.v.size();
  constexpr int kUnreached = -1;
  scratch.level.assign(bodies, kUnreached);

  // Level 1: the faster body of each contact that approaches on entry is the one that strikes.
  for (const ImpactContact& contact : problem.contacts) {
    if (approach_speed(contact, problem.v) <= 0.0) continue;
    const auto a = static_cast<std::size_t>(contact.a);
    const auto b = static_cast<std::size_t>(contact.b);
    scratch.level[problem.v[a].squaredNorm() >= problem.v[b].squaredNorm() ? a : b] = 0;
  }

  for (int level = 0; level < static_cast<int>(bodies); ++level) {
    scratch.v_before.assign(problem.v.begin(), problem.v.end());
    bool any = false;
    for (std::size_t i = 0; i < bodies; ++i) {
      if (scratch.level[i] != level) continue;
      Fan fan;
      for (const ImpactContact& contact : problem.contacts) {
        const bool is_a = contact.a == static_cast<int>(i);
        if (!is_a && contact.b != static_cast<int>(i)) continue;
        const int other = is_a ? contact.b : contact.a;
        const int reached = scratch.level[static_cast<std::size_t>(other)];
        if (reached != kUnreached && reached != level + 1) continue;
        if (approach_speed(contact, scratch.v_before) <= 0.0 || fan.size == kMaxAhead) continue;
        fan.ahead[static_cast<std::size_t>(fan.size++)] = {other, is_a ? contact.n_AB : Vector2{-contact.n_AB}, contact.restitution};
      }
      if (fan.size == 0) continue;
      any = true;

      Matrix2 seen = Matrix2::Identity();
      if (as_printed() && fan.size == 2) {
        // x runs from disc j to disc k (Fig. 5); (9), (10) have the sign of v_ix cos(.) turned round.
        const Vector2 x = (fan.ahead[1].n - fan.ahead[0].n).normalized();
        seen -= 2.0 * x * x.transpose();
      }
      const Impulses P = solve_fan(fan, scratch.v_before[i], problem.inverse_mass[i], problem.inverse_mass, scratch.v_before, seen);
      for (int k = 0; k < fan.size; ++k) {
        const Ahead& j = fan.ahead[static_cast<std::size_t>(k)];
        const auto disc = static_cast<std::size_t>(j.disc);
        // (17) as printed: disc B is given the impulse of disc A, sign and all.
        const double sign = as_printed() && fan.size == 1 ? -1.0 : 1.0;
        problem.v[disc] += sign * P[k] * problem.inverse_mass[disc] * j.n;
        problem.v[i] -= P[k] * problem.inverse_mass[i] * j.n;
        scratch.level[disc] = level + 1;
      }
    }
    if (!any) return;
  }
}

}  // namespace breakshot::world
