#pragma once

#include "common/joints.hpp"
#include "controller/loop/channels.hpp"
#include "controller/loop/loop_config.hpp"
#include "controller/motion/path_stop.hpp"
#include "controller/motion/trajectory.hpp"
#include "controller/safety/fail_safe.hpp"
#include "controller/safety/following_error.hpp"
#include "controller/safety/freshness.hpp"
#include "controller/safety/joint_setpoint.hpp"
#include "controller/safety/state_gate.hpp"

#include <cstdint>

namespace breakshot::control {

/// The control law: one call per period, from joint state to command.
///
/// Every result follows from the arguments and the requests taken from the channels, so a recorded run can be played back bit for bit. Where
/// the set-point goes on:
///   released --(fresh state)--> braking --> holding --(start)--> on trajectory --> settling --> holding
/// with a stop on the path or a brake out of every moving state, as safety::FailSafe decides. In a stop the set-point gives way, once, to
/// an arm that is held elsewhere, and the stop does not end before the two agree: resuming moves nothing. Time, not the count of calls, moves a
/// trajectory: when periods were skipped, the set-point is where it would have been.
class ControlLoop {
 public:
  /// @param channels  outlives the loop; this side of them is the loop's alone
  ControlLoop(const LoopConfig& config, LoopChannels& channels) noexcept;

  /// One tick.
  ///
  /// @param state  a joint state that came since the last tick, or nullptr; it may be anything: it is judged here
  /// @param now    instant of the tick, on the period's grid; later than at the last call (else the last command is returned again)
  /// @return the command for the drives. One without joints (q.size() == 0) is not to be sent: there is no measured position to start from.
  /// Cost: no allocation, no lock, no system call; about 1 us, in the tick that starts a stop about 60 us.
  JointCommand tick(const JointState* state, Time now) noexcept;

 private:
  enum class Motion : std::uint8_t {
    kReleased,  ///< no set-point: waits for a measured position to start from; nothing is sent
    kBraking,   ///< every joint to rest by itself
    kHolding,   ///< stands still
    kOnTrajectory,
    kStoppingOnPath,
    kSettling,   ///< the trajectory has ended; the arm is coming to rest
    kGivingWay,  ///< in a stop: the set-point goes to where the arm is
  };

  /// Whole periods since the last tick; 0 when time stands still, the drives' time-out when it ran backwards.
  std::int64_t periods_since_last(Time now) const noexcept;
  /// Judges the state, and the freshness of states.
  void observe(const JointState* state, std::int64_t periods) noexcept;
  /// Takes what the planning side asked for.
  void take_requests() noexcept;
  void apply_safety() noexcept;
  void recover() noexcept;
  void start_trajectory() noexcept;
  /// Takes up the stop that the safety machine asks for.
  void change_motion() noexcept;
  /// Starts a set-point where the arm is measured to be, if that is known.
  void anchor() noexcept;
  safety::Setpoint next_setpoint(std::int64_t periods) noexcept;
  safety::Setpoint advance_trajectory(std::int64_t periods) noexcept;
  /// Puts a brake in the place of a set-point that breaks a limit.
  void limit(safety::Setpoint& next, std::int64_t periods) noexcept;
  void watch_contact() noexcept;
  /// Ends a stroke whose arm has come to rest.
  void settle() noexcept;
  /// In a stop: lets the set-point go to where the arm is.
  void give_way() noexcept;
  void make_command() noexcept;
  void publish_status() noexcept;

  void give_up_stroke() noexcept;
  /// Returns the buffer to the planning side and forgets it.
  void give_back(const motion::Trajectory*& trajectory) noexcept;
  void release() noexcept;
  void refuse(const motion::Trajectory*& trajectory, LoopEvent::Refusal why) noexcept;
  void post(LoopEvent event) noexcept;
  bool moving() const noexcept { return motion_ != Motion::kHolding && motion_ != Motion::kReleased; }
  bool measured_at_rest() const noexcept;
  /// Largest distance of a joint from the set-point, rad.
  double distance_to_setpoint() const noexcept;
  bool obeyed() const noexcept;
  Time due() const noexcept { return now_ + config_.lead; }

  LoopConfig config_;
  LoopChannels& channels_;

  safety::StateGate gate_;
  safety::FreshnessWatchdog freshness_;
  safety::FollowingMonitor following_;
  safety::FailSafe fail_safe_;
  safety::CauseSet present_;  ///< conditions found in this tick
  int wrong_joints_in_a_row_ = 0;
  Time foreign_until_{};

  bool ticked_ = false;
  Time now_{};
  std::uint64_t ticks_ = 0;
  std::uint64_t skipped_ = 0;
  std::uint64_t seq_ = 0;         ///< of the last command
  std::uint64_t anchor_seq_ = 0;  ///< of the first command since the set-point was last anchored

  bool fresh_ = false;           ///< a good state came with this tick
  bool unknown_drives_ = false;  ///< this tick's state is of a session that is not confirmed: say nothing to whoever that is
  JointState state_;             ///< the newest good one
  JointState previous_state_;    ///< the good one before; same session

  Motion motion_ = Motion::kReleased;
  safety::Setpoint setpoint_;
  motion::PathStop path_stop_;
  bool unchecked_ = false;  ///< this tick's set-point has no predecessor to be held against

  const motion::Trajectory* trajectory_ = nullptr;
  const motion::Trajectory* offered_ = nullptr;  ///< asked to be started in this tick
  bool recovery_asked_ = false;
  std::int64_t cursor_ = -1;  ///< index of the last set-point sent; -1: none yet
  StrokePhase phase_ = StrokePhase::kAccepted;
  bool contact_pending_ = false;
  Time contact_at_{};  ///< when the arm is to pass the contact point
  Time settle_until_{};
  safety::JointArray give_way_target_{};
  bool gave_way_ = false;  ///< in this stop; only once, because an arm that runs away from its set-point must not be chased

  JointCommand command_;  ///< the last one
};

}  // namespace breakshot::control
