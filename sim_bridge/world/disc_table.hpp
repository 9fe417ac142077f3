#pragma once

#include "common/geometry.hpp"
#include "sim_bridge/world/friction_map.hpp"
#include "sim_bridge/world/ode.hpp"
#include "sim_bridge/world/table_physics.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace breakshot::sim_bridge {

/// The striker as the table feels it: a rod of which the arm's inertia stands behind every impact.
struct StrikerRod {
  Vector2 p_W{0.0, 0.0};              ///< axis at the height of the discs, m
  Vector2 v_W{0.0, 0.0};              ///< m/s; impacts change it
  double tip_z = 1.0;                 ///< height of the rod's lower face, m
  Matrix2 mobility{Matrix2::Zero()};  ///< change of v_W per impulse on the rod, 1/kg
  Vector2 impulse_W{0.0, 0.0};        ///< sum of what the rod took from the discs, N s
};

/// Where a rod that comes from above stands on a disc.
struct DiscBelow {
  std::size_t disc;
  double height;  ///< of its top over the table, m
};

/// Upright discs that slide on the table, in an ODE world of their own.
///
/// ODE moves the bodies and solves the impacts (QuickStep). What it is known to get wrong is taken out of its hands (reference/physics.md 4):
/// - Table friction is Coulomb's law applied explicitly: isotropic, exact at the stop, no creep. All bodies lie in one plane, z = 0 of this world.
/// - Contact normals come from the circles, not from the cylinder collider, so they are horizontal and exact.
/// - A contact enters the solver only while it approaches. Kinetic energy then cannot rise: of an impulse p at approach speed b it takes
///   p b (1 - e) / 2 >= 0. An impact passes through a cluster one layer per sub-step, which is what short elastic contacts do.
/// - Overlaps are undone by position, never by speed.
/// With TablePhysics::contact_time, contacts are springs with dampers instead, integrated here: another impact law for those who plan with the first one.
///
/// Discs at rest cost nothing. Private to sim_bridge.
class DiscTable {
 public:
  /// A round obstacle that stands on the table: the base of the arm, or a block.
  struct Post {
    Vector2 p_W;
    double radius;
  };
  DiscTable(const TablePhysics& physics, std::vector<Post> posts);

  /// Puts another set of obstacles in the place of those before. The caller has checked that no disc overlaps one.
  void stand(std::vector<Post> posts) { posts_ = std::move(posts); }

  /// Replaces all discs. The caller has checked them (check_discs()).
  void place(std::span<const DiscState> discs);

  /// One sub-step. Moves the discs; the rod's place is the caller's, its v_W and impulse_W are updated.
  void step(StrikerRod& rod, double dt);

  /// True when nothing slides: step() would change nothing unless the rod touches a disc.
  bool at_rest() const noexcept { return moving_count_ == 0; }
  /// True when a rod that moves by at most `reach` could touch the rim of a disc.
  bool within_reach(const StrikerRod& rod, double reach) const noexcept;

  /// The disc that the rod stands on rather than beside, if any.
  std::optional<DiscBelow> below(const StrikerRod& rod) const noexcept;
  /// Presses a disc on the table during the next sub-steps, N; 0 for none.
  void press(std::size_t disc, double force) noexcept { discs_[disc].load = force; }

  double kinetic_energy() const noexcept;
  /// Episodes of contact between rod and disc since place().
  std::uint32_t strikes() const noexcept { return strikes_; }
  std::size_t size() const noexcept { return discs_.size(); }
  DiscState state(std::size_t disc) const noexcept;

 private:
  struct Disc {
    Vector2 p, v;
    double spin = 0.0;  // rad/s
    double radius, height, mass;
    double load = 0.0;  // N, on top of its weight
    std::uint8_t colour;
    bool on_table;
    bool moving;
    bool struck = false;           // an episode of contact with the rod is under way
    double rod_restitution = 0.0;  // of that episode
    dBodyID body;
  };

  /// One sub-step with springs in the place of impacts (disc_table_compliant.cpp).
  void step_compliant(StrikerRod& rod, double dt);
  void press_together(Disc& a, Disc& b, double dt) noexcept;
  void press_on_rod(Disc& disc, StrikerRod& rod, double dt) noexcept;
  void press_on_post(Disc& disc, const Post& post, double dt) noexcept;
  /// Force between two bodies that overlap, from the reduced mass behind it: N, never pulling.
  double spring_force(double mass, double restitution, double overlap, double approach) const noexcept;
  void rest_or_fall(Disc& disc) noexcept;

  void brake_by_friction(Disc& disc, double dt) const noexcept;
  void find_impacts(const StrikerRod& rod);
  void add_contact(dBodyID a, dBodyID b, const Vector2& p, const Vector2& n_BA, double restitution);
  void wake(Disc& disc) noexcept;
  void solve(StrikerRod& rod, double dt);
  void read_bodies() noexcept;
  void undo_overlaps(const StrikerRod& rod) noexcept;
  static bool beside(const StrikerRod& rod, const Disc& disc, double overlap) noexcept;

  TablePhysics physics_;
  FrictionMap friction_;
  std::vector<Post> posts_;
  std::vector<Disc> discs_;
  std::size_t moving_count_ = 0;
  std::uint32_t strikes_ = 0;

  ode::World world_;
  ode::JointGroup contacts_;
  int contact_count_ = 0;
  dBodyID rod_ = nullptr;
  Vector2 rod_normal_{0.0, 0.0};  // of the rod's contacts in this sub-step, weighted by approach speed; zero: it has none
};

/// What is wrong with discs that are to be placed; empty when nothing is. Discs may touch but not overlap.
std::string check_discs(std::span<const DiscState> discs, const Rect& table);

}  // namespace breakshot::sim_bridge
