#pragma once

#include "common/joints.hpp"
#include "common/stroke.hpp"
#include "controller/motion/trajectory.hpp"
#include "controller/rt/spsc_ring.hpp"
#include "controller/rt/triple_buffer.hpp"
#include "controller/safety/command_limiter.hpp"
#include "controller/safety/fail_safe.hpp"
#include "controller/safety/following_error.hpp"
#include "controller/safety/joint_setpoint.hpp"
#include "controller/safety/state_gate.hpp"

#include <array>
#include <cstdint>

namespace breakshot::rt {

// Their vectors have a fixed capacity: a copy stays within the object.
template <>
inline constexpr bool kSelfContained<JointState> = true;
template <>
inline constexpr bool kSelfContained<JointCommand> = true;

}  // namespace breakshot::rt

namespace breakshot::control {

/// What the planning side asks of the loop.
struct LoopRequest {
  enum class Kind : std::uint8_t {
    /// Run `trajectory`, from rest or, with a join, out of the running one; the loop gives the buffer back through LoopChannels::returns, whatever
    /// comes of it.
    kStart = 0,
    kStop = 1,              ///< controlled stop, then nothing until a recovery
    kRecover = 2,           ///< end a stop, if it may be; the set-point starts anew at the measured position
    kForeignCommander = 3,  ///< somebody else's commands were seen just now
  };
  /// Where a trajectory takes over from the running one, without a rest between them.
  struct Join {
    std::uint64_t number = 0;  ///< trajectory_number of the one that runs before; 0: none, it starts from rest
    std::uint64_t tick = 0;    ///< of that one, which is the first of the new one
  };
  Kind kind = Kind::kStop;
  const motion::Trajectory* trajectory = nullptr;
  std::uint64_t trajectory_number = 0;  ///< counts the trajectories handed over, from 1: a buffer is used again, its number is not
  Join join{};
};

/// What happened on the real-time thread. Fields that a kind does not name are zero.
struct LoopEvent {
  enum class Kind : std::uint8_t {
    kPhase = 0,         ///< the stroke entered `phase`
    kContact = 1,       ///< q, qd: at the contact point, before the impact (docs/controller.md)
    kDone = 2,          ///< the stroke ended: the arm is at rest, or with `joined`, another stroke took over in motion
    kStopped = 3,       ///< the stroke was given up because of `causes`
    kNotStarted = 4,    ///< the trajectory was not taken: `refusal`, `causes`
    kRecovered = 5,     ///< a stop ended
    kNotRecovered = 6,  ///< it may not end yet: `causes`
    kSafety = 7,        ///< `causes` became active; with `violation` or `following` when they tell more
  };
  /// Why a trajectory was not taken.
  enum class Refusal : std::uint8_t {
    kNone = 0,
    kBusy = 1,       ///< something moves
    kNotReady = 2,   ///< stopped, or no fresh state
    kBadBuffer = 3,  ///< empty, another number of joints, or another tick
    kElsewhere = 4,  ///< does not begin at the set-point, or at the tick of its join
    kMissed = 5,     ///< what it was to take over from is past the tick of the join, no longer at its own pace, or another one
  };

  Kind kind = Kind::kPhase;
  StrokePhase phase = StrokePhase::kAccepted;
  Refusal refusal = Refusal::kNone;
  safety::CauseSet causes{};
  std::uint64_t stroke_id = 0;
  bool joined = false;  ///< with kDone
  Time time{};
  safety::JointArray q{};   ///< rad
  safety::JointArray qd{};  ///< rad/s
  safety::LimitViolation violation{};
  safety::FollowingError following{};
};

/// How things stand after a tick; the newest one is always to be had.
struct LoopStatus {
  Time now{};
  std::uint64_t ticks = 0;
  std::uint64_t skipped = 0;  ///< periods that got no tick
  safety::Action action = safety::Action::kHold;
  safety::CauseSet causes;           ///< active ones
  safety::CauseSet in_the_way;       ///< of a recovery: conditions that are still there, and causes that are for ever
  bool commanding = false;           ///< set-points go out; false while there is no measured position to start from
  bool fresh = false;                ///< the joint states are fresh
  bool obeyed = false;               ///< the drives take our commands
  bool moving = false;               ///< a motion or a stop is under way
  bool at_rest = false;              ///< commanded and measured
  std::uint64_t stroke_id = 0;       ///< of the trajectory that the loop holds; 0: none
  std::uint64_t joinable = 0;        ///< number of the trajectory that runs at its own pace, so that another may take over from it; 0: none
  std::int64_t cursor = -1;          ///< its tick that was sent last; -1: none yet
  std::uint64_t session = 0;         ///< of the drives
  safety::Setpoint setpoint;         ///< the last command
  safety::JointArray measured_q{};   ///< rad
  safety::JointArray measured_qd{};  ///< rad/s
  std::array<std::uint64_t, safety::kStateFlaws> states{};  ///< joint states met so far, by StateFlaw

  /// Stopped: nothing moves before a recovery.
  bool stopped() const noexcept { return action > safety::Action::kHold; }
  /// A stroke may start.
  bool ready() const noexcept { return action == safety::Action::kRun && commanding && fresh && obeyed && !moving; }
};

/// The lock-free links between the loop and the planning side. Each has one writer and one reader. Sizes: far more than can be under way,
/// because no more than two strokes are under way; whatever is dropped nevertheless is counted.
struct LoopChannels {
  rt::SpscRing<LoopRequest, 16> requests;               ///< to the loop
  rt::SpscRing<LoopEvent, 256> events;                  ///< from the loop
  rt::SpscRing<const motion::Trajectory*, 16> returns;  ///< from the loop: buffers that it is done with
  rt::TripleBuffer<LoopStatus> status;                  ///< from the loop
};

const char* to_string(LoopEvent::Refusal refusal) noexcept;

}  // namespace breakshot::control
