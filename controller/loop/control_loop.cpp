#include "controller/loop/control_loop.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace breakshot::control {

using motion::Trajectory;
using safety::Action;
using safety::Cause;
using safety::JointArray;
using safety::Setpoint;
using safety::StateFlaw;

namespace {

/// So many states with a wrong number of joints, one after another, are no accident.
constexpr int kWrongJointsTolerated = 20;
/// A foreign command counts as present for so long.
constexpr Duration kForeignMemory = std::chrono::seconds{1};
/// A trajectory begins where the set-point is, but for rounding and the first tick's motion, rad.
constexpr double kStartTolerance = 1e-4;
/// A join's two ends are the same state but for rounding: rad, rad/s, rad/s^2.
constexpr double kJoinTolerance = 1e-6;

JointArray to_array(const JointVector& vector) noexcept {
  JointArray array{};
  std::copy_n(vector.data(), vector.size(), array.begin());
  return array;
}

}  // namespace

ControlLoop::ControlLoop(const LoopConfig& config, LoopChannels& channels, FlightTap* flight) noexcept
    : LoopMemory{config}, config_{config}, channels_{channels}, flight_{flight} {}

void ControlLoop::restore(const LoopMemory& memory, const Trajectory* trajectory, const Trajectory* next) noexcept {
  static_cast<LoopMemory&>(*this) = memory;
  trajectory_ = trajectory;
  next_trajectory_ = next;
  path_stop_.follow(trajectory);
  path_pace_.follow(trajectory);
}

JointCommand ControlLoop::tick(const JointState* state, Time now) noexcept {
  const std::int64_t periods = periods_since_last(now);
  if (periods == 0) return command_;
  if (flight_ != nullptr && ticks_ % FlightTap::kKeyframeEvery == 0)
    flight_->keyframes.push({ticks_ + 1, static_cast<const LoopMemory&>(*this)});
  record_.requests = 0;
  record_.told = 0;
  ++ticks_;
  if (ticked_) skipped_ += static_cast<std::uint64_t>(periods - 1);
  ticked_ = true;
  now_ = now;

  present_ = {};
  observe(state, periods);
  take_requests();
  watch_contact();
  apply_safety();
  change_motion();
  settle();
  give_way();
  recover();
  start_trajectory();
  anchor();

  command_ = {};
  if (motion_ != Motion::kReleased) {
    Setpoint next = next_setpoint(periods);
    limit(next, periods);
    setpoint_ = next;
    if (!unknown_drives_) make_command();
  }
  drop_missed();
  publish_status();
  if (flight_ != nullptr) record_flight(state);
  return command_;
}

std::int64_t ControlLoop::periods_since_last(Time now) const noexcept {
  if (!ticked_) return 1;
  if (now == now_) return 0;
  // A clock that ran backwards says nothing of how long the drives went without us: assume the worst.
  if (now < now_) return config_.drive_timeout_ticks;
  return std::max<std::int64_t>((now - now_ + config_.period / 2) / config_.period, 1);
}

void ControlLoop::observe(const JointState* state, std::int64_t periods) noexcept {
  fresh_ = false;
  unknown_drives_ = false;
  if (state != nullptr) {
    const auto verdict = gate_.judge(*state, now_);
    fresh_ = verdict.flaw == StateFlaw::kNone;
    unknown_drives_ = verdict.flaw == StateFlaw::kNewSession;
    wrong_joints_in_a_row_ = verdict.flaw == StateFlaw::kWrongJoints ? std::min(wrong_joints_in_a_row_ + 1, kWrongJointsTolerated) : 0;
    if (fresh_) {
      if (state_.q.size() == 0 || verdict.new_session) {
        past_states_.fill(*state);
      } else {
        std::move_backward(past_states_.begin(), past_states_.end() - 1, past_states_.end());
        past_states_.front() = state_;
      }
      state_ = *state;
    }
    present_.add(Cause::kDrivesRestarted, verdict.new_session);
  }
  freshness_.update(fresh_, now_);

  const bool commanding = motion_ != Motion::kReleased;
  present_.add(Cause::kNoState, !freshness_.established());
  present_.add(Cause::kStatePredicted, freshness_.established() && freshness_.predicted());
  present_.add(Cause::kStateStale, freshness_.established() && freshness_.stale());
  present_.add(Cause::kWrongDrives, wrong_joints_in_a_row_ >= kWrongJointsTolerated);
  present_.add(Cause::kCommandGap, commanding && periods >= config_.drive_timeout_ticks);
  // Before they have taken the first command since the set-point was anchored, the drives are braked by right, and not yet following.
  if (commanding && fresh_ && state_.command_seq >= anchor_seq_ && state_.command_seq <= seq_) {
    present_.add(Cause::kDrivesBraked, state_.braked);
    const auto error = following_.check(state_, config_.drive_lag);
    present_.add(Cause::kFollowingError, error.joint >= 0);
    if (error.joint >= 0 && !fail_safe_.active().has(Cause::kFollowingError)) {
      LoopEvent event{.kind = LoopEvent::Kind::kSafety};
      event.causes.add(Cause::kFollowingError);
      event.following = error;
      post(event);
    }
  }
}

void ControlLoop::take_requests() noexcept {
  recovery_asked_ = false;
  LoopRequest request;
  while (record_.requests < kRequestsPerTick && channels_.requests.pop(request)) {
    record_.request[record_.requests++] = {request.kind, request.trajectory_number, request.join};
    switch (request.kind) {
      case LoopRequest::Kind::kStart:
        if (offered_.trajectory != nullptr) {
          refuse(request.trajectory, LoopEvent::Refusal::kBusy);
        } else {
          offered_ = request;
        }
        break;
      case LoopRequest::Kind::kStop: present_.add(Cause::kStopRequested); break;
      case LoopRequest::Kind::kRecover: recovery_asked_ = true; break;
      case LoopRequest::Kind::kForeignCommander: foreign_until_ = now_ + kForeignMemory; break;
    }
  }
  present_.add(Cause::kForeignCommander, now_ < foreign_until_);
}

void ControlLoop::apply_safety() noexcept {
  const safety::CauseSet begun = fail_safe_.update(present_);
  // A following error has told of itself, with its figures.
  safety::CauseSet to_tell = begun;
  safety::CauseSet told;
  told.add(Cause::kFollowingError);
  to_tell = to_tell.without(told);
  if (!to_tell.empty()) post({.kind = LoopEvent::Kind::kSafety, .causes = to_tell});

  // Also when the cause still waits for a recovery: drives that restart once more are somewhere else once more.
  for (std::size_t i = 0; i < safety::kCauses; ++i) {
    if (present_.has(static_cast<Cause>(i)) && safety::kRules[i].release) {
      release();
      return;
    }
  }
}

void ControlLoop::change_motion() noexcept {
  switch (fail_safe_.action()) {
    case Action::kRun:
    case Action::kHold:
      // Without a word from the arm the stroke goes on along its path, more and more slowly, and goes on from there when there is one.
      if (fail_safe_.active().has(Cause::kStatePredicted)) {
        if (motion_ == Motion::kOnTrajectory) {
          path_pace_.start(*trajectory_, static_cast<std::size_t>(std::max<std::int64_t>(cursor_, 0)), 0.0);
          motion_ = Motion::kPaced;
        } else if (motion_ == Motion::kPaced && path_pace_.target() > 0.0) {
          path_pace_.change(0.0);
        }
      } else if (motion_ == Motion::kPaced && path_pace_.target() == 0.0) {
        path_pace_.change(1.0);
      }
      return;
    case Action::kControlledStop:
      if (motion_ == Motion::kPaced && path_pace_.target() > 0.0) path_pace_.change(0.0);
      if (motion_ == Motion::kOnTrajectory) {
        path_stop_.start(*trajectory_, static_cast<std::size_t>(std::max<std::int64_t>(cursor_, 0)));
        motion_ = Motion::kStoppingOnPath;
      }
      // With nobody there that listens, say nothing: drives that start up later would otherwise go to where the old ones were told to be.
      if (motion_ == Motion::kHolding && freshness_.stale() && !config_.always_answer) release();
      return;
    case Action::kProtectiveStop:
    case Action::kFault:
      if (trajectory_ != nullptr) {
        give_up_stroke();
        motion_ = Motion::kBraking;
      }
      return;
  }
}

void ControlLoop::recover() noexcept {
  if (!recovery_asked_) return;
  const bool at_place = motion_ == Motion::kReleased || distance_to_setpoint() <= config_.give_way_tolerance;
  const bool at_rest = !moving() && !freshness_.stale() && measured_at_rest() && at_place;
  if (!fail_safe_.recover(at_rest)) {
    post({.kind = LoopEvent::Kind::kNotRecovered, .causes = fail_safe_.active()});
    return;
  }
  gave_way_ = false;
  post({.kind = LoopEvent::Kind::kRecovered});
}

void ControlLoop::start_trajectory() noexcept {
  if (offered_.trajectory == nullptr) return;
  if (offered_.join.number != 0) return hold_next();
  using Refusal = LoopEvent::Refusal;
  const Trajectory& offer = *offered_.trajectory;
  if (moving()) return refuse(offered_.trajectory, Refusal::kBusy);
  if (fail_safe_.action() != Action::kRun || motion_ != Motion::kHolding || !obeyed())
    return refuse(offered_.trajectory, Refusal::kNotReady);
  if (!fits(offer)) return refuse(offered_.trajectory, Refusal::kBadBuffer);
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    // Written so that NaN is refused.
    if (!(std::abs(offer.points[0].q[j] - setpoint_.q[j]) <= kStartTolerance)) return refuse(offered_.trajectory, Refusal::kElsewhere);
  }
  trajectory_ = std::exchange(offered_.trajectory, nullptr);
  trajectory_number_ = offered_.trajectory_number;
  cursor_ = -1;
  phase_ = StrokePhase::kAccepted;
  contact_pending_ = false;
  motion_ = Motion::kOnTrajectory;
}

void ControlLoop::hold_next() noexcept {
  const LoopEvent::Refusal why = judge_join();
  if (why != LoopEvent::Refusal::kNone) return refuse(offered_.trajectory, why);
  next_trajectory_ = std::exchange(offered_.trajectory, nullptr);
  next_number_ = offered_.trajectory_number;
  join_tick_ = static_cast<std::int64_t>(offered_.join.tick);
}

LoopEvent::Refusal ControlLoop::judge_join() const noexcept {
  using Refusal = LoopEvent::Refusal;
  const Trajectory& offer = *offered_.trajectory;
  if (next_trajectory_ != nullptr) return Refusal::kBusy;
  if (fail_safe_.action() > Action::kHold) return Refusal::kNotReady;
  const auto [number, tick] = offered_.join;
  if (joinable() != number || tick >= trajectory_->size || cursor_ > static_cast<std::int64_t>(tick)) return Refusal::kMissed;
  if (!fits(offer)) return Refusal::kBadBuffer;
  const motion::TrajectoryPoint& from = trajectory_->points[tick];
  const motion::TrajectoryPoint& to = offer.points[0];
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    const bool same = std::abs(to.q[j] - from.q[j]) <= kJoinTolerance && std::abs(to.qd[j] - from.qd[j]) <= kJoinTolerance &&
                      std::abs(to.qdd[j] - from.qdd[j]) <= kJoinTolerance;
    if (!same) return Refusal::kElsewhere;
  }
  return Refusal::kNone;
}

bool ControlLoop::fits(const Trajectory& offer) const noexcept {
  return offer.size > 0 && offer.size <= Trajectory::kCapacity && offer.joints == config_.limits.joints && offer.tick == config_.period;
}

void ControlLoop::make_command() noexcept {
  const Eigen::Index joints = config_.limits.joints;
  ++seq_;
  command_.seq = seq_;
  command_.session = config_.session;
  command_.state_seq = state_.seq;
  command_.due = due();
  command_.q = JointVector::Map(setpoint_.q.data(), joints);
  command_.qd = JointVector::Map(setpoint_.qd.data(), joints);
  command_.qdd = JointVector::Map(setpoint_.qdd.data(), joints);
  following_.sent(command_.due, setpoint_);
}

void ControlLoop::publish_status() noexcept {
  LoopStatus status;
  status.now = now_;
  status.ticks = ticks_;
  status.skipped = skipped_;
  status.action = fail_safe_.action();
  status.causes = fail_safe_.active();
  status.commanding = motion_ != Motion::kReleased;
  status.fresh = freshness_.established() && !freshness_.stale();
  status.obeyed = obeyed();
  status.moving = moving();
  status.at_rest = !moving() && status.fresh && measured_at_rest();
  status.in_the_way = fail_safe_.in_the_way();
  status.stroke_id = trajectory_ != nullptr ? trajectory_->stroke_id : 0;
  status.joinable = joinable();
  status.cursor = cursor_;
  status.session = state_.session;
  status.setpoint = setpoint_;
  status.measured_q = to_array(state_.q);
  status.measured_qd = to_array(state_.qd);
  status.states = gate_.counts();
  channels_.status.write(status);
}

void ControlLoop::record_flight(const JointState* state) noexcept {
  record_.tick = ticks_;
  record_.now = now_;
  record_.came = state != nullptr;
  if (record_.came) record_.state = *state;
  record_.command = command_;
  record_.action = fail_safe_.action();
  record_.causes = fail_safe_.active();
  record_.motion = motion_;
  record_.stroke_id = trajectory_ != nullptr ? trajectory_->stroke_id : 0;
  flight_->ticks.push(record_);
}

void ControlLoop::give_up_stroke() noexcept {
  if (trajectory_ == nullptr) return;
  post({.kind = LoopEvent::Kind::kStopped, .causes = fail_safe_.active()});
  give_back(trajectory_);
  contact_pending_ = false;
}

void ControlLoop::give_back(const Trajectory*& trajectory) noexcept {
  channels_.returns.push(trajectory);
  if (&trajectory == &trajectory_) trajectory_number_ = 0;
  if (&trajectory == &next_trajectory_) next_number_ = 0;
  trajectory = nullptr;
}

void ControlLoop::release() noexcept {
  give_up_stroke();
  following_.clear();
  motion_ = Motion::kReleased;
}

void ControlLoop::refuse(const Trajectory*& trajectory, LoopEvent::Refusal why) noexcept {
  post({.kind = LoopEvent::Kind::kNotStarted, .refusal = why, .causes = fail_safe_.active(), .stroke_id = trajectory->stroke_id});
  give_back(trajectory);
}

void ControlLoop::post(LoopEvent event) noexcept {
  event.time = now_;
  if (event.stroke_id == 0 && trajectory_ != nullptr) event.stroke_id = trajectory_->stroke_id;
  record_.told = static_cast<std::uint16_t>(record_.told | 1U << static_cast<unsigned>(event.kind));
  channels_.events.push(event);
}

bool ControlLoop::obeyed() const noexcept {
  return motion_ != Motion::kReleased && !state_.braked && state_.command_seq >= anchor_seq_ && state_.command_seq <= seq_;
}

}  // namespace breakshot::control
