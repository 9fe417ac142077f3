#include "sim_bridge/world/disc_table.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <sstream>

namespace breakshot::sim_bridge {
namespace {

/// An episode of contact between rod and disc is over when they are this far apart.
constexpr double kEpisodeGap = 1e-3;  // m
/// Overlap that rounding leaves between touching discs and that is left alone, m.
constexpr double kNoOverlap = 1e-7;
/// Overlap of discs to be placed that passes for touching: what coordinates written to the micrometre leave, m.
constexpr double kOverlapAllowed = 2e-6;
/// Share of a persistent overlap that is undone per sub-step. Small, because most overlaps are those of an impact in the same sub-step and go away by themselves.
constexpr double kUndo = 0.1;
/// A pair that separates faster than this undoes its overlap without help, m/s.
constexpr double kSeparating = 1e-3;
/// Sweeps of the impact solver over the contacts of one layer; layers of a rack have a handful of contacts, and the sweeps converge geometrically.
constexpr int kSweeps = 60;

/// Sweeps visit contacts in an order drawn from a generator that all of a program's ODE worlds share. Its state is set before each solve that
/// draws from it, so that a world's future depends on nothing but its own past, on whatever thread it runs.
std::mutex& order_of_sweeps() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

DiscTable::DiscTable(const TablePhysics& physics, std::vector<Post> posts)
    : physics_{physics}, friction_{physics.friction, physics.friction_spread, physics.friction_seed}, posts_{std::move(posts)} {
  dWorldSetGravity(world_.id(), 0.0, 0.0, 0.0);  // weight enters through friction alone
  dWorldSetCFM(world_.id(), 0.0);                // rigid: softness would take restitution away
  dWorldSetQuickStepNumIterations(world_.id(), kSweeps);
  dWorldSetQuickStepW(world_.id(), 1.0);  // plain Gauss-Seidel: exact after one sweep for one contact
  rod_ = dBodyCreate(world_.id());
  dBodyDisable(rod_);
}

void DiscTable::place(std::span<const DiscState> discs) {
  for (Disc& disc : discs_) dBodyDestroy(disc.body);
  discs_.clear();
  moving_count_ = 0;
  strikes_ = 0;
  for (const DiscState& state : discs) {
    Disc disc{.p = state.p_WD,
              .v = state.v_WD_W,
              .radius = state.radius,
              .height = state.height,
              .mass = state.mass,
              .colour = state.colour,
              .on_table = state.on_table,
              .moving = false,
              .body = dBodyCreate(world_.id())};
    dMass mass;
    dMassSetCylinderTotal(&mass, disc.mass, 3, disc.radius, disc.height);
    dBodySetMass(disc.body, &mass);
    dBodySetGyroscopicMode(disc.body, 0);  // an upright disc that spins about its own axis has no gyroscopic torque
    Pose X_WD = Pose::Identity();
    X_WD.translation() << disc.p, 0.0;
    X_WD.linear() = Eigen::AngleAxisd{state.yaw, Vector3::UnitZ()}.toRotationMatrix();
    ode::set_pose(disc.body, X_WD);
    dBodyDisable(disc.body);
    discs_.push_back(disc);
    if (!disc.v.isZero(0.0) && disc.on_table) wake(discs_.back());
  }
}

void DiscTable::wake(Disc& disc) noexcept {
  if (disc.moving) return;
  disc.moving = true;
  ++moving_count_;
  dBodyEnable(disc.body);
}

// Sliding and spinning share one friction force (Howe and Cutkosky's ellipsoidal limit surface, for a disc of even pressure: a moment arm of
// 2R/3). Without spin this is Coulomb's law. The stop is exact: what friction could reverse within the sub-step it ends instead.
void DiscTable::brake_by_friction(Disc& disc, double dt) const noexcept {
  const double moment_arm = 2.0 / 3.0 * disc.radius;
  const double slip = std::hypot(disc.v.x(), disc.v.y(), moment_arm * disc.spin);
  const double deceleration = friction_.at(disc.p) * (kGravity + disc.load / disc.mass);
  const double lost = deceleration * dt;
  if (lost >= slip) {
    disc.v.setZero();
    disc.spin = 0.0;
    return;
  }
  const double share = lost / slip;
  disc.v *= 1.0 - share;
  disc.spin *= 1.0 - share * (moment_arm * moment_arm) / (0.5 * disc.radius * disc.radius);
}

bool DiscTable::beside(const StrikerRod& rod, const Disc& disc, double overlap) noexcept {
  // A rod that came down on a disc overlaps it far in plan and little in height; one that meets its rim the other way round.
  return disc.on_table && rod.tip_z < disc.height && overlap <= disc.height - rod.tip_z;
}

bool DiscTable::within_reach(const StrikerRod& rod, double reach) const noexcept {
  return std::any_of(discs_.begin(), discs_.end(), [&](const Disc& disc) {
    return disc.on_table && rod.tip_z < disc.height + reach && (disc.p - rod.p_W).norm() < disc.radius + physics_.striker_radius + reach;
  });
}

std::optional<DiscBelow> DiscTable::below(const StrikerRod& rod) const noexcept {
  for (std::size_t i = 0; i < discs_.size(); ++i) {
    const Disc& disc = discs_[i];
    if (!disc.on_table || rod.tip_z >= disc.height) continue;
    const double overlap = disc.radius + physics_.striker_radius - (disc.p - rod.p_W).norm();
    if (overlap > 0.0 && !beside(rod, disc, overlap)) return DiscBelow{i, disc.height};
  }
  return std::nullopt;
}

void DiscTable::add_contact(dBodyID a, dBodyID b, const Vector2& p, const Vector2& n_BA, double restitution) {
  dContact contact{};
  contact.surface.mode = dContactBounce;
  contact.surface.bounce = restitution;
  contact.surface.bounce_vel = 0.0;
  if (physics_.contact_friction > 0.0) {
    contact.surface.mode |= dContactMu2 | dContactFDir1 | dContactApprox1_1;
    contact.surface.mu = physics_.contact_friction;
    contact.fdir1[0] = -n_BA.y();
    contact.fdir1[1] = n_BA.x();
  }
  contact.geom.pos[0] = p.x();
  contact.geom.pos[1] = p.y();
  contact.geom.normal[0] = n_BA.x();
  contact.geom.normal[1] = n_BA.y();
  dJointAttach(dJointCreateContact(world_.id(), contacts_.id(), &contact), a, b);
  ++contact_count_;
}

void DiscTable::find_impacts(const StrikerRod& rod) {
  contact_count_ = 0;
  rod_normal_.setZero();
  const auto bounce = [](double approach, double threshold, double restitution) { return approach > threshold ? restitution : 0.0; };

  // Discs that a contact wakes up are behind in this loop or before it; either way their own contacts count from the next sub-step on.
  for (std::size_t i = 0; i < discs_.size(); ++i) {
    Disc& a = discs_[i];
    if (!a.on_table) continue;
    for (std::size_t j = i + 1; j < discs_.size(); ++j) {
      Disc& b = discs_[j];
      if (!b.on_table || (!a.moving && !b.moving)) continue;
      const Vector2 p_BA = a.p - b.p;
      const double reach = a.radius + b.radius;
      if (p_BA.squaredNorm() > reach * reach) continue;
      const Vector2 n_BA = p_BA.normalized();
      const double approach = (b.v - a.v).dot(n_BA);
      if (approach <= 0.0) continue;
      wake(a);
      wake(b);
      add_contact(a.body, b.body, b.p + b.radius * n_BA, n_BA, bounce(approach, physics_.bounce_speed, physics_.restitution));
    }
    for (const Post& post : posts_) {
      if (!a.moving || (a.p - post.p_W).norm() > a.radius + post.radius) continue;
      const Vector2 n = (a.p - post.p_W).normalized();
      const double approach = -a.v.dot(n);
      if (approach <= 0.0) continue;
      add_contact(a.body, nullptr, post.p_W + post.radius * n, n, bounce(approach, physics_.bounce_speed, physics_.restitution));
    }
    const Vector2 p_SA = a.p - rod.p_W;
    const double overlap = a.radius + physics_.striker_radius - p_SA.norm();
    if (overlap < -kEpisodeGap) a.struck = false;
    if (overlap < 0.0 || !beside(rod, a, overlap)) continue;
    const Vector2 n = p_SA.normalized();
    const double approach = (rod.v_W - a.v).dot(n);
    if (approach <= 0.0) continue;
    wake(a);
    add_contact(a.body, rod_, rod.p_W + physics_.striker_radius * n, n,
                bounce(approach, physics_.striker_bounce_speed, physics_.striker_restitution));
    rod_normal_ += approach * n;
    if (!a.struck) ++strikes_;
    a.struck = true;
  }
}

void DiscTable::solve(StrikerRod& rod, double dt) {
  for (Disc& disc : discs_) {
    if (!disc.moving) continue;
    dBodySetLinearVel(disc.body, disc.v.x(), disc.v.y(), 0.0);
    dBodySetAngularVel(disc.body, 0.0, 0.0, disc.spin);
  }
  const bool rod_touches = !rod_normal_.isZero(0.0);
  double rod_mass = 0.0;
  if (rod_touches) {
    // In the solver the rod is a body with the arm's effective mass along the contact's normal. That is exact for one contact; when the rod
    // touches two discs at once, as in a push, their mean direction counts.
    const Vector2 n = rod_normal_.normalized();
    rod_mass = 1.0 / n.dot(rod.mobility * n);
    dMass mass;
    dMassSetSphereTotal(&mass, rod_mass, 1.0);
    dBodySetMass(rod_, &mass);
    dBodySetPosition(rod_, rod.p_W.x(), rod.p_W.y(), 0.0);
    dBodySetLinearVel(rod_, rod.v_W.x(), rod.v_W.y(), 0.0);
    dBodySetAngularVel(rod_, 0.0, 0.0, 0.0);
    dBodyEnable(rod_);
  }

  if (contact_count_ > 1) {
    const std::lock_guard lock{order_of_sweeps()};
    dRandSetSeed(1);
    dWorldQuickStep(world_.id(), dt);
  } else {
    dWorldQuickStep(world_.id(), dt);
  }
  contacts_.clear();

  if (rod_touches) {
    const Vector2 v_after = ode::to_vector(dBodyGetLinearVel(rod_)).head<2>();
    const Vector2 impulse = rod_mass * (v_after - rod.v_W);
    rod.impulse_W += impulse;
    rod.v_W += rod.mobility * impulse;
    dBodyDisable(rod_);
  }
}

void DiscTable::read_bodies() noexcept {
  for (Disc& disc : discs_) {
    if (!disc.moving) continue;
    disc.v = ode::to_vector(dBodyGetLinearVel(disc.body)).head<2>();
    disc.p = ode::to_vector(dBodyGetPosition(disc.body)).head<2>();
    disc.spin = dBodyGetAngularVel(disc.body)[2];
    rest_or_fall(disc);
  }
}

void DiscTable::rest_or_fall(Disc& disc) noexcept {
  if (!physics_.table.contains(disc.p)) {
    disc.on_table = false;
    disc.v.setZero();
    disc.spin = 0.0;
  }
  if (!disc.v.isZero(0.0) || disc.spin != 0.0) return;
  disc.moving = false;
  --moving_count_;
  dBodyDisable(disc.body);
}

void DiscTable::undo_overlaps(const StrikerRod& rod) noexcept {
  const auto shift = [](Disc& disc, const Vector2& by) {
    disc.p += by;
    dBodySetPosition(disc.body, disc.p.x(), disc.p.y(), 0.0);
  };
  for (std::size_t i = 0; i < discs_.size(); ++i) {
    Disc& a = discs_[i];
    if (!a.on_table || !a.moving) continue;
    const Vector2 p_SA = a.p - rod.p_W;
    const double rod_overlap = a.radius + physics_.striker_radius - p_SA.norm();
    if (rod_overlap > kNoOverlap && beside(rod, a, rod_overlap) && (a.v - rod.v_W).dot(p_SA.normalized()) < kSeparating) {
      shift(a, kUndo * rod_overlap * p_SA.normalized());
    }
    for (std::size_t j = 0; j < discs_.size(); ++j) {
      Disc& b = discs_[j];
      if (j == i || !b.on_table || (b.moving && j < i)) continue;
      const Vector2 p_BA = a.p - b.p;
      const double reach = a.radius + b.radius;
      if (p_BA.squaredNorm() >= reach * reach) continue;
      const double overlap = reach - p_BA.norm();
      const Vector2 n_BA = p_BA.normalized();
      if (overlap < kNoOverlap || (a.v - b.v).dot(n_BA) > kSeparating) continue;
      shift(a, 0.5 * kUndo * overlap * n_BA);
      shift(b, -0.5 * kUndo * overlap * n_BA);
    }
  }
}

void DiscTable::step(StrikerRod& rod, double dt) {
  if (physics_.contact_time > 0.0) return step_compliant(rod, dt);
  for (Disc& disc : discs_) {
    if (disc.moving) brake_by_friction(disc, dt);
  }
  find_impacts(rod);
  if (moving_count_ == 0) return;
  solve(rod, dt);
  read_bodies();
  undo_overlaps(rod);
}

double DiscTable::kinetic_energy() const noexcept {
  double sum = 0.0;
  for (const Disc& disc : discs_) {
    sum += 0.5 * disc.mass * (disc.v.squaredNorm() + 0.5 * disc.radius * disc.radius * disc.spin * disc.spin);
  }
  return sum;
}

DiscState DiscTable::state(std::size_t disc) const noexcept {
  const Disc& d = discs_[disc];
  const dReal* R = dBodyGetRotation(d.body);
  return {.p_WD = d.p,
          .v_WD_W = d.v,
          .yaw = std::atan2(R[4], R[0]),
          .radius = d.radius,
          .height = d.height,
          .mass = d.mass,
          .colour = d.colour,
          .on_table = d.on_table};
}

std::string check_discs(std::span<const DiscState> discs, const Rect& table) {
  std::ostringstream found;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const DiscState& a = discs[i];
    const bool finite = a.p_WD.allFinite() && a.v_WD_W.allFinite() && std::isfinite(a.yaw);
    if (!finite || !(a.radius > 0.0) || !(a.height > 0.0) || !(a.mass > 0.0) || !std::isfinite(a.radius + a.height + a.mass)) {
      found << "disc " << i << ": numbers must be finite, radius, height and mass above 0";
      return found.str();
    }
    if (!table.contains(a.p_WD)) {
      found << "disc " << i << " at (" << a.p_WD.x() << ", " << a.p_WD.y() << ") m is off the table";
      return found.str();
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double overlap = a.radius + discs[j].radius - (a.p_WD - discs[j].p_WD).norm();
      if (overlap <= kOverlapAllowed) continue;
      found << "discs " << j << " and " << i << " overlap by " << overlap * 1e3 << " mm";
      return found.str();
    }
  }
  return {};
}

}  // namespace breakshot::sim_bridge
