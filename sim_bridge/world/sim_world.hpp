#pragma once

#include "common/joints.hpp"
#include "common/sim_interface.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/arm/drive_settings.hpp"
#include "sim_bridge/arm/servo_drives.hpp"
#include "sim_bridge/world/table_physics.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace breakshot::sim_bridge {

/// An upright post that stands on the table where nobody expects it. The rod and the discs run into it; the arm's other links do not.
struct Block {
  Vector2 p_W{0.0, 0.0};  ///< axis, m
  double radius = 0.03;   ///< m
  double height = 0.2;    ///< m
};

struct SimSettings {
  TablePhysics physics;
  DriveSettings drives;
  /// Sub-step of the arm. Divides the tick; 0.25 ms or finer.
  Duration arm_step = std::chrono::microseconds{250};
  /// Sub-steps of the discs per sub-step of the arm: 62.5 us, so that a disc at 1 m/s overlaps the next by 0.06 mm at most when they meet.
  int table_steps = 4;
  Pose X_WB{Pose::Identity()};  ///< the arm's base
  JointVector q_start;          ///< where the arm stands at first, rad; empty: all joints at 0
  std::uint64_t session = 1;    ///< of the drives, for JointState::session
  Time start{};                 ///< of the cell clock
};

/// The striker as a disc felt it: the instant before the first impulse.
struct Strike {
  Time at{};  ///< on the grid of the table's sub-steps, so late by one of them at most
  Vector2 p_WS{0.0, 0.0};
  Vector2 v_WS_W{0.0, 0.0};
};

/// The whole physical cell: arm, drives, striker, table and discs, advanced tick by tick.
///
/// Arm and discs are two ODE worlds that exchange momentum at the striker in every sub-step: an impact sees the arm's effective mass at the
/// tip along the contact's normal, and the arm takes the opposite impulse at its last link. The rod counts as upright beside a disc, and
/// nothing but the rod meets the discs (other than the base, which is an obstacle).
///
/// Deterministic: equal inputs at equal ticks give bit-identical states, on any thread. Not thread-safe; worlds are independent of each other.
class SimWorld {
 public:
  static constexpr Duration kTick = std::chrono::milliseconds{1};

  /// @throws std::invalid_argument for settings out of range or a q_start of the wrong size or outside the joints' ranges
  SimWorld(const ArmDescription& arm, const SimSettings& settings);
  ~SimWorld();
  SimWorld(SimWorld&&) noexcept;
  SimWorld& operator=(SimWorld&&) noexcept;

  /// Offers the drives a command, now.
  CommandVerdict command(const JointCommand& command) noexcept;

  /// Advances by kTick. Cost: 2 us at rest, 40 us with the arm moving, 90 us with six discs sliding as well (docs/simulator.md).
  void tick();

  /// Lets the clock jump ahead with nothing moving (a bridge that woke too late to catch up).
  void slip(Duration by) noexcept;

  /// Replaces all discs; the arm stays as it is, the strikes count from 0 again.
  /// @throws std::invalid_argument that says which disc overlaps what, is off the table, or has an absurd number
  void place(std::span<const SimDisc> discs);

  /// Puts a block on the table, in the place of the one before; nothing takes it away.
  /// @throws std::invalid_argument that says what it overlaps, that it is off the table, or which number is absurd
  void block(const std::optional<Block>& block);

  /// Lets the drives give only this share of their torque, 0 to 1; 1: all of it. For fault injection.
  void weaken_drives(double share) noexcept;

  Time now() const noexcept;
  JointState joint_state() const noexcept;
  /// Reuses the vectors' memory.
  void snapshot(WorldSnapshot& into) const;
  /// All but seq and control_seq, which belong to the topic.
  SimTruth truth() const;

  /// The first time that the striker met a disc since place(). For scoring.
  const std::optional<Strike>& first_strike() const noexcept;

  /// True when no disc moves.
  bool discs_at_rest() const noexcept;
  double kinetic_energy() const noexcept;  ///< of the discs, J
  Vector3 p_WT() const noexcept;           ///< striker tip
  Vector3 v_WT() const noexcept;

  /// Largest force between the rod and the block during the last tick, N.
  double block_force() const noexcept;

  /// How often each CommandVerdict was given.
  std::span<const std::uint64_t> verdicts() const noexcept;
  /// Largest share of its torque limit that any drive used so far; 1: one saturated.
  double peak_torque_share() const noexcept;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace breakshot::sim_bridge
