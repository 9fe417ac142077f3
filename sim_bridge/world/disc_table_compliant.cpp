#include "sim_bridge/world/disc_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

// Contacts as linear springs with dampers (Cundall and Strack 1979): for two bodies alone the impact lasts contact_time and keeps the restitution to
// 0.02 from e = 0.7 upward (below it is higher than asked, 0.38 for 0.3, because contacts do not pull: Schwager and Poeschel 2007); bodies that touch are loaded at the same time, as no law of instants has it (reference/physics.md, section 2). No friction at the rims.

namespace breakshot::sim_bridge {

namespace {

/// Steps of the integration per contact time: e is then right to 1 %.
constexpr double kStepsPerContact = 30.0;
/// Of the rod that pushes, so that it stays at the disc.
constexpr double kPlastic = 0.05;
/// As in disc_table.cpp.
constexpr double kEpisodeGap = 1e-3;  // m

}  // namespace

double DiscTable::spring_force(double mass, double restitution, double overlap, double approach) const noexcept {
  const double log_e = std::log(std::clamp(restitution, kPlastic, 1.0));
  const double tc = physics_.contact_time;
  const double stiffness = mass * (std::numbers::pi * std::numbers::pi + log_e * log_e) / (tc * tc);
  const double damping = -2.0 * mass * log_e / tc;
  return std::max(0.0, stiffness * overlap + damping * approach);
}

void DiscTable::press_together(Disc& a, Disc& b, double dt) noexcept {
  const Vector2 p_BA = a.p - b.p;
  const double reach = a.radius + b.radius;
  if (p_BA.squaredNorm() >= reach * reach) return;
  const double distance = p_BA.norm();
  const Vector2 n_BA = p_BA / distance;
  const double mass = a.mass * b.mass / (a.mass + b.mass);
  const double force = spring_force(mass, physics_.restitution, reach - distance, (b.v - a.v).dot(n_BA));
  if (force == 0.0) return;
  // Table friction holds a resting disc against forces below mu m g.
  for (Disc* disc : {&a, &b}) {
    if (!disc->moving && force > friction_.at(disc->p) * disc->mass * kGravity) wake(*disc);
  }
  if (a.moving) a.v += force * dt / a.mass * n_BA;
  if (b.moving) b.v -= force * dt / b.mass * n_BA;
}

void DiscTable::press_on_post(Disc& disc, const Post& post, double dt) noexcept {
  const Vector2 p = disc.p - post.p_W;
  const double overlap = disc.radius + post.radius - p.norm();
  if (overlap <= 0.0) return;
  const Vector2 n = p.normalized();
  disc.v += spring_force(disc.mass, physics_.restitution, overlap, -disc.v.dot(n)) * dt / disc.mass * n;
}

void DiscTable::press_on_rod(Disc& disc, StrikerRod& rod, double dt) noexcept {
  const Vector2 p_SD = disc.p - rod.p_W;
  const double overlap = disc.radius + physics_.striker_radius - p_SD.norm();
  if (overlap < -kEpisodeGap) disc.struck = false;
  if (overlap <= 0.0 || !beside(rod, disc, overlap)) return;
  const Vector2 n = p_SD.normalized();
  const double approach = (rod.v_W - disc.v).dot(n);
  if (!disc.struck) {
    if (approach <= 0.0) return;
    ++strikes_;
    disc.struck = true;
    disc.rod_restitution = approach > physics_.striker_bounce_speed ? physics_.striker_restitution : 0.0;
  }
  const double mobility = n.dot(rod.mobility * n);
  const double force = spring_force(disc.mass / (1.0 + disc.mass * mobility), disc.rod_restitution, overlap, approach);
  if (force == 0.0) return;
  wake(disc);
  const Vector2 impulse = force * dt * n;
  disc.v += impulse / disc.mass;
  rod.v_W -= rod.mobility * impulse;
  rod.impulse_W -= impulse;
}

void DiscTable::step_compliant(StrikerRod& rod, double dt) {
  const int steps = std::max(1, static_cast<int>(std::ceil(dt * kStepsPerContact / physics_.contact_time)));
  const double h = dt / steps;
  const Vector2 p_rod = rod.p_W;
  for (int step = 0; step < steps; ++step) {
    for (std::size_t i = 0; i < discs_.size(); ++i) {
      Disc& disc = discs_[i];
      if (!disc.on_table) continue;
      press_on_rod(disc, rod, h);
      for (std::size_t j = i + 1; j < discs_.size(); ++j) {
        if (discs_[j].on_table && (disc.moving || discs_[j].moving)) press_together(disc, discs_[j], h);
      }
      for (const Post& post : posts_) {
        if (disc.moving) press_on_post(disc, post, h);
      }
    }
    if (moving_count_ == 0) break;
    for (Disc& disc : discs_) {
      if (!disc.moving) continue;
      brake_by_friction(disc, h);
      disc.p += h * disc.v;
      rest_or_fall(disc);
    }
    rod.p_W += h * rod.v_W;  // for the contacts of this sub-step; the caller moves the rod
  }
  rod.p_W = p_rod;
  for (const Disc& disc : discs_) dBodySetPosition(disc.body, disc.p.x(), disc.p.y(), 0.0);
}

}  // namespace breakshot::sim_bridge
