#pragma once

#include "common/joints.hpp"
#include "controller/loop/channels.hpp"
#include "controller/loop/flight_tap.hpp"
#include "controller/loop/loop_config.hpp"
#include "controller/loop/loop_memory.hpp"
#include "controller/motion/trajectory.hpp"
#include "controller/safety/fail_safe.hpp"
#include "controller/safety/joint_setpoint.hpp"

#include <cstdint>

namespace breakshot::control {

/// The control law: one call per period, from joint state to command.
///
/// Every result follows from the arguments and the requests taken from the channels, so a recorded run can be played back bit for bit. Where
/// the set-point goes on:
///   released --(fresh state)--> braking --> holding --(start)--> on trajectory --> settling --> holding
/// with a next trajectory taking over from the running one at a tick at which both are in the same motion, and with a stop on the path or a brake
/// out of every moving state, as safety::FailSafe decides. In a stop the set-point gives way, once, to an arm that is held elsewhere, and the
/// stop does not end before the two agree: resuming moves nothing. Time, not the count of calls, moves a trajectory: when periods were skipped, the set-point is where it would have been.
class ControlLoop : private LoopMemory {
 public:
  /// @param channels  outlives the loop; this side of them is the loop's alone
  /// @param flight    gets what every tick took and gave, and from time to time the memory; outlives the loop; may be null
  ControlLoop(const LoopConfig& config, LoopChannels& channels, FlightTap* flight = nullptr) noexcept;

  /// One tick.
  ///
  /// @param state  a joint state that came since the last tick, or nullptr; it may be anything: it is judged here
  /// @param now    instant of the tick, on the period's grid; later than at the last call (else the last command is returned again)
  /// @return the command for the drives. One without joints (q.size() == 0) is not to be sent: there is no measured position to start from.
  /// Cost: no allocation, no lock, no system call; about 1 us, in the tick that starts a stop about 60 us.
  JointCommand tick(const JointState* state, Time now) noexcept;

  /// Goes on where the loop that this memory is of stood before a tick. Not for the real-time thread.
  ///
  /// @param trajectory  the one that LoopMemory::trajectory_number_ names; null when that is 0
  /// @param next        the same for next_number_
  void restore(const LoopMemory& memory, const motion::Trajectory* trajectory, const motion::Trajectory* next) noexcept;

 private:
  /// Whole periods since the last tick; 0 when time stands still, the drives' time-out when it ran backwards.
  std::int64_t periods_since_last(Time now) const noexcept;
  /// Judges the state, and the freshness of states.
  void observe(const JointState* state, std::int64_t periods) noexcept;
  /// Takes what the planning side asked for.
  void take_requests() noexcept;
  void apply_safety() noexcept;
  void recover() noexcept;
  void start_trajectory() noexcept;
  /// Keeps what was offered until the running trajectory comes to the join.
  void hold_next() noexcept;
  /// Why what was offered cannot take over at its join; kNone: it can.
  LoopEvent::Refusal judge_join() const noexcept;
  bool fits(const motion::Trajectory& offer) const noexcept;
  /// Takes up the stop that the safety machine asks for.
  void change_motion() noexcept;
  /// Starts a set-point where the arm is measured to be, if that is known.
  void anchor() noexcept;
  safety::Setpoint next_setpoint(std::int64_t periods) noexcept;
  safety::Setpoint advance_trajectory(std::int64_t periods) noexcept;
  safety::Setpoint advance_paced(std::int64_t periods) noexcept;
  /// The next trajectory takes over.
  void join() noexcept;
  /// A next trajectory whose predecessor is no longer on its way at its own pace cannot take over any more.
  void drop_missed() noexcept;
  void enter(StrokePhase phase) noexcept;
  void begin_to_settle() noexcept;
  /// Puts a brake in the place of a set-point that breaks a limit.
  void limit(safety::Setpoint& next, std::int64_t periods) noexcept;
  void watch_contact() noexcept;
  /// Ends a stroke whose arm has come to rest.
  void settle() noexcept;
  /// In a stop: lets the set-point go to where the arm is.
  void give_way() noexcept;
  void make_command() noexcept;
  void publish_status() noexcept;
  void record_flight(const JointState* state) noexcept;

  void give_up_stroke() noexcept;
  /// Returns the buffer to the planning side and forgets it.
  void give_back(const motion::Trajectory*& trajectory) noexcept;
  void release() noexcept;
  void refuse(const motion::Trajectory*& trajectory, LoopEvent::Refusal why) noexcept;
  void post(LoopEvent event) noexcept;
  /// The running trajectory's number, if another one may take over from it; else 0.
  std::uint64_t joinable() const noexcept { return motion_ == Motion::kOnTrajectory ? trajectory_number_ : 0; }
  bool moving() const noexcept { return motion_ != Motion::kHolding && motion_ != Motion::kReleased; }
  bool measured_at_rest() const noexcept;
  /// Largest distance of a joint from the set-point, rad.
  double distance_to_setpoint() const noexcept;
  bool obeyed() const noexcept;
  Time due() const noexcept { return now_ + config_.lead; }

  LoopConfig config_;
  LoopChannels& channels_;
  FlightTap* flight_;

  // What holds for one tick only; everything that a tick leaves to the next is in LoopMemory.
  safety::CauseSet present_;     ///< conditions found
  bool fresh_ = false;           ///< a good state came
  bool unknown_drives_ = false;  ///< the state is of a session that is not confirmed: say nothing to whoever that is
  LoopRequest offered_;          ///< asked to be started; without a trajectory: nothing was
  bool recovery_asked_ = false;
  TickRecord record_;
};

}  // namespace breakshot::control
