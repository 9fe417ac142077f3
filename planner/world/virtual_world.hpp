#pragma once

#include "common/result.hpp"
#include "planner/world/disc.hpp"
#include "planner/world/friction_map.hpp"
#include "planner/world/impact_law.hpp"
#include "planner/world/meetings.hpp"
#include "planner/world/sliding_bodies.hpp"
#include "planner/world/striker_motion.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace breakshot::world {

struct WorldSettings {
  double friction = 0.25;  ///< mu between disc and table, > 0
  std::shared_ptr<const FrictionMap> friction_map =
      nullptr;                       ///< factors on `friction` from place to place; none: it is the same everywhere
  double restitution = 0.8;          ///< e between two discs, 0 ... 1
  double striker_restitution = 0.8;  ///< e between striker and disc, 0 ... 1
  /// A disc that the striker meets more slowly than this stays at it, m/s: e falls to nothing at low speed in every real material. 0: all bounce alike.
  double striker_bounce_speed = 0.0;
  /// Contacts with a gap up to this take part in an impact as if they touched, m, unless the law takes_near_contacts() not. 1e-5 is a hundredth of what the camera resolves; the
  /// paper's analysis, which takes what looks like touching for touching, wants more (docs/strategies.md).
  double touch_gap = 1e-5;
  double allowed_overlap = 1e-5;  ///< discs given with a deeper overlap are refused, m
  bool audit = false;             ///< whether rollouts say what impacts did to energy and momentum; costs a tenth of the time
};

/// What came of a stroke in the virtual world. `p_WD` belongs to the world and lasts until its next rollout.
struct Rollout {
  enum class Status : std::uint8_t {
    kAtRest = 0,      ///< everything came to rest
    kLawFailed = 1,   ///< the impact law left the bodies of an impact approaching: only `paper_as_printed` does
    kEventLimit = 2,  ///< more impacts than a law that keeps the energy bound can cause
  };
  Status status = Status::kAtRest;
  std::span<const Vector2> p_WD;  ///< resting places, in the order of the discs given; where they were when status is not kAtRest
  double duration = 0.0;          ///< from the start of the run until the last disc rests, s
  double smallest_gap = 0.0;      ///< at rest, m; infinity with fewer than two discs
  int impacts = 0;
  /// With `audit`, over the impacts without the striker: the largest relative rise of the kinetic energy of those that took part, <= rounding for
  /// laws that keep the energy bound; and the largest change of their momentum, over the sum of its magnitudes before.
  double energy_gain = 0.0;
  double momentum_error = 0.0;
};

/// What is wrong with the input of a rollout, for people.
struct WorldInputError {
  std::string text;
};

/// The virtual world: discs that slide on a table, collide, and come to rest.
///
/// Between impacts every disc slides in a straight line with the deceleration mu g (Coulomb friction, no spin), so the state between
/// impacts is known in closed form and only impacts and borders of a friction map are events: nothing is integrated in time. Stopping is folded into the motion. Which
/// velocities an impact leaves is the impact law's affair.
///
/// Ends for every law that keeps the energy bound when e < 1: an impact needs an approach of kQuietApproach at least, so each costs no
/// less than (1 - e^2) m kQuietApproach^2 / 4 of an energy that is finite (the striker adds a bounded amount). Otherwise an event limit
/// ends it and the status says so.
///
/// Keeps its buffers from call to call: a rollout allocates only when it sees more discs than any before. Not for use by two threads at once.
class VirtualWorld {
 public:
  /// @throws std::invalid_argument when a setting is out of its range
  VirtualWorld(const WorldSettings& settings, std::shared_ptr<const ImpactLaw> law);

  /// Runs the discs, and the striker if there is one, until all is at rest.
  ///
  /// Refuses NaN, radii and masses not above zero, overlaps deeper than allowed_overlap, and a striker that starts inside a disc by more.
  /// Cost: about 2 us for the break of six discs (docs/results.md).
  Result<Rollout, WorldInputError> run(std::span<const Disc> discs, const StrikerRun* striker = nullptr) &;

  const WorldSettings& settings() const noexcept { return settings_; }
  const ImpactLaw& law() const noexcept { return *law_; }

 private:
  void load(std::span<const Disc> discs, const StrikerRun* striker);
  Rollout rest(Rollout rollout, double time);
  /// Sets the striker on the leg that begins now.
  void drive_striker(double time) noexcept;
  /// Does so at its turn, and looks whom it meets.
  void turn_striker(double time) noexcept;
  /// Lets a disc slide as far as the friction where it is goes.
  void slide(std::size_t disc, const Vector2& v, double time) noexcept;
  void cross_border(double time) noexcept;
  /// Inverse of the mass that a body sets against an impulse along n, 1/kg.
  double inverse_mass_along(std::size_t body, const Vector2& n) const noexcept;
  void strike(std::size_t body, const Vector2& v, double time) noexcept;
  /// The same for the striker, which takes the impulse, N s.
  void throw_back(const Vector2& impulse, double time) noexcept;
  bool resolve_impact(std::size_t i, std::size_t j, double time, Rollout& rollout);
  bool resolve_pair(std::size_t i, std::size_t j, double time, Rollout& rollout) noexcept;
  bool resolve_group(std::size_t i, std::size_t j, double time, Rollout& rollout);
  void gather_contacts(std::size_t i, std::size_t j);
  /// Of a contact in an impact whose fastest contact has this approach speed.
  double restitution_of(std::size_t i, std::size_t j, double approach) const noexcept;

  WorldSettings settings_;
  std::shared_ptr<const ImpactLaw> law_;
  double touch_gap_ = 0.0;  // of contacts that take part in an impact

  SlidingBodies bodies_;  // the discs, then the striker while it is down
  std::size_t discs_ = 0;
  StrikerMotion striker_;
  Matrix2 striker_mobility_{Matrix2::Zero()};
  double striker_turn_ = kNever;  // when its motion changes by itself

  /// A disc's arrival where friction changes.
  struct Crossing {
    double time = kNever;
    Vector2 v{0.0, 0.0};  ///< its velocity then
  };
  std::vector<Crossing> crossings_;  // by disc; none without a friction map
  std::size_t next_crossing_ = 0;

  Meetings meetings_;
  BoundKernels kernels_ = bound_kernels();
  std::vector<std::size_t> struck_;  // bodies whose velocity the impact at hand has changed
  std::vector<char> is_struck_;
  std::vector<Vector2> rest_;

  // One impact: the bodies of the touching group that it reaches, and their contacts.
  std::vector<std::size_t> group_;
  std::vector<int> group_index_;  // body -> place in group_, or -1
  std::vector<Vector2> group_v_;
  std::vector<Vector2> group_v_before_;
  std::vector<double> group_inverse_mass_;
  std::vector<ImpactContact> contacts_;
  ImpactScratch scratch_;
};

}  // namespace breakshot::world
