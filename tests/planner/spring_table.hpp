#pragma once

#include "planner/world/laws/compliant.hpp"
#include "planner/world/virtual_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

namespace breakshot::test {

/// The whole run of discs on a table with springs in the place of impacts, step by step: what physics.md 2 holds the impact laws against.
struct SpringTable {
  double contact_time = 1e-4;  ///< of two discs without damping, s
  double friction = 0.25;
  double restitution = 0.8;

  /// Where the discs come to rest. Steps of a hundredth of the contact time; friction as a deceleration, stopped at zero.
  std::vector<Vector2> rest(std::span<const world::Disc> discs) const {
    const double dt = contact_time / 100.0;
    const double omega = std::numbers::pi / contact_time;
    const double ratio = world::damping_ratio(restitution);
    std::vector<Vector2> p, v;
    for (const auto& disc : discs) {
      p.push_back(disc.p_WD);
      v.push_back(disc.v_WD_W);
    }
    std::vector<char> in_contact(discs.size() * discs.size());
    for (bool moves = true; moves;) {
      for (std::size_t i = 0; i < discs.size(); ++i) {
        for (std::size_t j = i + 1; j < discs.size(); ++j) push(discs, i, j, omega, ratio, dt, p, v, in_contact[i * discs.size() + j]);
      }
      moves = false;
      for (std::size_t i = 0; i < discs.size(); ++i) {
        const double speed = v[i].norm();
        const double slower = std::max(0.0, speed - friction * kGravity * dt);
        v[i] *= speed > 0.0 ? slower / speed : 0.0;
        p[i] += dt * v[i];
        moves = moves || slower > 0.0;
      }
    }
    return p;
  }

 private:
  static void push(std::span<const world::Disc> discs, std::size_t i, std::size_t j, double omega, double ratio, double dt,
                   const std::vector<Vector2>& p, std::vector<Vector2>& v, char& ended) {
    const Vector2 way = p[j] - p[i];
    const double reach = discs[i].radius + discs[j].radius;
    if (way.squaredNorm() >= reach * reach) {
      ended = 0;
      return;
    }
    const double distance = way.norm();
    const Vector2 n = way / distance;
    const double approach = (v[i] - v[j]).dot(n);
    const double force = omega * omega * (reach - distance) + 2.0 * ratio * omega * approach;
    // Over with its force, until the discs are apart or approach again.
    if (approach > 0.0) ended = 0;
    if (force <= 0.0) ended = 1;
    if (ended != 0) return;
    const double P = dt * force / (1.0 / discs[i].mass + 1.0 / discs[j].mass);
    v[i] -= P / discs[i].mass * n;
    v[j] += P / discs[j].mass * n;
  }
};

}  // namespace breakshot::test
