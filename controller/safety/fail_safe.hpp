#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace breakshot::safety {

/// What the controller does, in order of precedence: of all causes that are active, the one furthest down decides.
enum class Action : std::uint8_t {
  kRun = 0,             ///< motions run and may start
  kHold = 1,            ///< no motion starts; one that runs goes on along its path, on prediction and slowing down
  kControlledStop = 2,  ///< brakes along the path of the motion, then holds
  kProtectiveStop = 3,  ///< brakes every joint as hard as it may, at once, then holds
  kFault = 4,           ///< as a protective stop; only a restart of the controller leaves it
};

/// Why it does not just run.
enum class Cause : std::uint8_t {
  kNoState = 0,           ///< no usable joint state since the start
  kStatePredicted = 1,    ///< no fresh joint state for a few ticks
  kStopRequested = 2,     ///< a cancel, or the process ends
  kForeignCommander = 3,  ///< somebody else sends commands to these drives
  kStateStale = 4,        ///< no fresh joint state for too long
  kDrivesBraked = 5,      ///< the drives stopped taking our commands and braked by themselves
  kDrivesRestarted = 6,   ///< the joint states come from a new session
  kCommandGap = 7,        ///< we were held up for so long that the drives must have braked by themselves
  kFollowingError = 8,    ///< the arm is not where it was told to be
  kCommandLimit = 9,      ///< the next command would have broken a limit
  kWrongDrives = 10,      ///< the drives have another number of joints than the arm
};
inline constexpr std::size_t kCauses = 11;

/// When a cause, once active, ends.
enum class Clear : std::uint8_t {
  kWhenGone = 0,  ///< with its condition
  kRecovery = 1,  ///< when its condition is gone, the arm is at rest, and somebody asks for it
  kNever = 2,     ///< not in this process's life
};

/// What a cause does.
struct Rule {
  Action action;
  Clear clear;
  bool release;  ///< the drives do not follow the set-point any more: give it up, and start a new one at the measured position
};

/// The whole policy. Indexed by Cause.
inline constexpr std::array<Rule, kCauses> kRules{{
    {Action::kHold, Clear::kWhenGone, true},             // kNoState
    {Action::kHold, Clear::kWhenGone, false},            // kStatePredicted
    {Action::kControlledStop, Clear::kRecovery, false},  // kStopRequested
    {Action::kControlledStop, Clear::kRecovery, false},  // kForeignCommander
    {Action::kControlledStop, Clear::kRecovery, false},  // kStateStale
    {Action::kProtectiveStop, Clear::kRecovery, true},   // kDrivesBraked
    {Action::kProtectiveStop, Clear::kRecovery, true},   // kDrivesRestarted
    {Action::kProtectiveStop, Clear::kRecovery, true},   // kCommandGap
    {Action::kProtectiveStop, Clear::kRecovery, false},  // kFollowingError: the drives still listen, so the set-point has to stay smooth
    {Action::kProtectiveStop, Clear::kRecovery, false},  // kCommandLimit: the last command was sound, so braking starts there
    {Action::kFault, Clear::kNever, true},               // kWrongDrives
}};

/// A set of causes.
class CauseSet {
 public:
  constexpr CauseSet() = default;
  constexpr explicit CauseSet(std::uint16_t bits) noexcept : bits_{bits} {}

  constexpr void add(Cause cause) noexcept { bits_ = static_cast<std::uint16_t>(bits_ | bit(cause)); }
  constexpr void add(Cause cause, bool present) noexcept {
    if (present) add(cause);
  }
  constexpr bool has(Cause cause) const noexcept { return (bits_ & bit(cause)) != 0; }
  constexpr bool empty() const noexcept { return bits_ == 0; }
  constexpr std::uint16_t bits() const noexcept { return bits_; }
  /// Those of this set and not of `other`.
  constexpr CauseSet without(CauseSet other) const noexcept { return CauseSet{static_cast<std::uint16_t>(bits_ & ~other.bits_)}; }
  constexpr CauseSet with(CauseSet other) const noexcept { return CauseSet{static_cast<std::uint16_t>(bits_ | other.bits_)}; }
  /// The cause whose action is furthest down (the first of several). The set must not be empty.
  Cause worst() const noexcept;
  constexpr bool operator==(const CauseSet&) const noexcept = default;

 private:
  static constexpr std::uint16_t bit(Cause cause) noexcept { return static_cast<std::uint16_t>(1U << static_cast<unsigned>(cause)); }
  std::uint16_t bits_ = 0;
};

/// The fail-safe state machine. Its state is the set of active causes; its output is the action furthest down among theirs.
///
/// (The shape is PX4's failsafe framework: ordered actions, a clear condition per cause. Recovery is always somebody's decision: a cause that
/// stopped the arm never restarts it by going away.)
class FailSafe {
 public:
  /// Takes the conditions of this tick.
  /// @return causes that have just become active
  CauseSet update(CauseSet present) noexcept;

  /// Ends all causes that wait for a recovery, if it may be: the arm is at rest, no such cause's condition is still there, and none is
  /// for ever.
  /// @return whether it was done; true also when there was nothing to end
  bool recover(bool at_rest) noexcept;
  /// What keeps recover(true) from being done: conditions that are still there, and causes that are for ever.
  CauseSet in_the_way() const noexcept;
  /// Whether recover(true) would now be done.
  bool recoverable() const noexcept { return in_the_way().empty(); }

  Action action() const noexcept;
  CauseSet active() const noexcept { return active_; }

  /// What it remembers, for the flight recorder.
  template <typename Self, typename Code>
  static void fields(Self& self, Code& code) {
    code(self.present_, self.active_);
  }

 private:
  CauseSet present_;  ///< conditions of the last update
  CauseSet active_;
};

/// Those of the causes that do not end by themselves.
CauseSet lasting(CauseSet causes) noexcept;

const char* to_string(Action action) noexcept;
/// For people, as the end of the sentence "stopped: ...".
const char* to_string(Cause cause) noexcept;

}  // namespace breakshot::safety
