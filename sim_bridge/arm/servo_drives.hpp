#pragma once

#include "common/joints.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/arm/drive_settings.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace breakshot::sim_bridge {

/// What the drives said to a command. Everything but kTaken leaves them as they were.
enum class CommandVerdict : std::uint8_t {
  kTaken = 0,
  kMalformed = 1,     ///< wrong number of joints, or a number that is not finite
  kOutOfRange = 2,    ///< a position outside its joint's range
  kTooFast = 3,       ///< a speed above its joint's limit
  kJump = 4,          ///< not reachable from the last set-point, or from where the drives are past it, within its joint's speed
  kOld = 5,           ///< seq or due not above the last one taken: late, doubled or out of order
  kBadDue = 6,        ///< due further ahead than the horizon, or so long ago that it means nothing
  kOtherSession = 7,  ///< another commander holds the drives
};
inline constexpr std::size_t kCommandVerdicts = 8;
const char* to_string(CommandVerdict verdict) noexcept;

/// Where the drives want the joints to be.
struct DriveReference {
  JointVector q;    ///< rad
  JointVector qd;   ///< rad/s
  JointVector qdd;  ///< rad/s^2
};

/// The part of the drives that turns commands into a reference: the door for commands, the interpolation between them, and the brake.
///
/// Knows no physics. Time is an input; nothing here allocates or throws once constructed.
class ServoDrives {
 public:
  /// @param q  where the arm stands, rad
  ServoDrives(const ArmDescription& arm, const DriveSettings& settings, const JointVector& q);

  /// Checks a command and takes or refuses it. A free drive (braked, or never commanded) takes the first good command's session as its commander.
  CommandVerdict take(const JointCommand& command, Time now) noexcept;

  /// To be called once per tick before the reference is read: brakes when the commander has been silent for too long.
  void watch(Time now) noexcept;

  /// The reference at `now`: cubic Hermite between the set-points on both sides of now - lag, straight on past the newest. Whatever commands came: finite,
  /// inside the joints' ranges, never faster than their speeds, and without a jump from one instant to the next.
  DriveReference reference(Time now) const noexcept;

  /// True when the reference is at rest at `now` and stays so until the next command.
  bool holds_still(Time now) const noexcept;
  bool braked() const noexcept { return braked_; }
  /// seq of the last command taken, of whichever commander; 0 before the first.
  std::uint64_t command_seq() const noexcept { return command_seq_; }
  /// How often each verdict was given, by CommandVerdict.
  const std::array<std::uint64_t, kCommandVerdicts>& verdicts() const noexcept { return verdicts_; }

 private:
  struct Knot {
    Time due;
    JointVector q, qd, qdd;
  };
  /// Knots kept: enough for every command that the horizon and the lag can hold at 1 kHz to span now - lag.
  static constexpr std::size_t kKnots = 128;

  /// A command together with where the way to it begins.
  struct Leg {
    Knot from, to;
  };
  CommandVerdict judge(const JointCommand& command, Time now) const noexcept;
  /// The way to a command, or nothing when every way breaks a joint's speed.
  std::optional<Leg> leg(const JointCommand& command, Time now) const noexcept;
  bool within_speed(const Leg& leg) const noexcept;
  const Knot& knot(std::size_t age) const noexcept { return knots_[(newest_ + kKnots - age) % kKnots]; }
  void push(const Knot& knot) noexcept;
  void restart(const Knot& first) noexcept;
  DriveReference follow(Time at) const noexcept;
  DriveReference slow_down(Time now) const noexcept;

  int joints_;
  DriveSettings settings_;
  JointVector lower_, upper_, max_speed_;

  std::array<Knot, kKnots> knots_;
  std::size_t newest_ = 0;
  std::size_t count_ = 0;

  bool braked_ = true;
  Time brake_began_{};
  Duration brake_time_{};
  DriveReference brake_from_;

  std::uint64_t session_ = 0;
  std::uint64_t command_seq_ = 0;
  Time taken_at_{};
  std::array<std::uint64_t, kCommandVerdicts> verdicts_{};
};

}  // namespace breakshot::sim_bridge
