#include "controller/loop/control_loop.hpp"

#include "controller/safety/command_limiter.hpp"
#include "controller/safety/joint_brake.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace breakshot::control {

using motion::Trajectory;
using motion::TrajectoryPoint;
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
/// The measurements on both sides of the contact must not lie further apart: the speed between them would say little.
constexpr Duration kContactBracket = std::chrono::milliseconds{20};

JointArray to_array(const JointVector& vector) noexcept {
  JointArray array{};
  std::copy_n(vector.data(), vector.size(), array.begin());
  return array;
}

Setpoint to_setpoint(const TrajectoryPoint& point) noexcept { return {point.q, point.qd, point.qdd}; }

}  // namespace

ControlLoop::ControlLoop(const LoopConfig& config, LoopChannels& channels) noexcept
    : config_{config},
      channels_{channels},
      gate_{gate_limits(config)},
      freshness_{config.freshness},
      following_{config.limits.joints, config.following},
      path_stop_{config.stop} {}

JointCommand ControlLoop::tick(const JointState* state, Time now) noexcept {
  const std::int64_t periods = periods_since_last(now);
  if (periods == 0) return command_;
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
  publish_status();
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
      const bool first = state_.q.size() == 0;
      previous_state_ = first || verdict.new_session ? *state : state_;
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
  while (channels_.requests.pop(request)) {
    switch (request.kind) {
      case LoopRequest::Kind::kStart:
        if (offered_ != nullptr) {
          refuse(request.trajectory, LoopEvent::Refusal::kBusy);
        } else {
          offered_ = request.trajectory;
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
  if (begun.empty()) return;
  // A following error has told of itself, with its figures.
  safety::CauseSet to_tell = begun;
  safety::CauseSet told;
  told.add(Cause::kFollowingError);
  to_tell = to_tell.without(told);
  if (!to_tell.empty()) post({.kind = LoopEvent::Kind::kSafety, .causes = to_tell});

  for (std::size_t i = 0; i < safety::kCauses; ++i) {
    if (begun.has(static_cast<Cause>(i)) && safety::kRules[i].release) {
      release();
      return;
    }
  }
}

void ControlLoop::change_motion() noexcept {
  switch (fail_safe_.action()) {
    case Action::kRun:
    case Action::kHold: return;
    case Action::kControlledStop:
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

void ControlLoop::settle() noexcept {
  if (motion_ != Motion::kSettling) return;
  const bool arrived = fresh_ && state_.stamp + config_.max_settle >= settle_until_ && measured_at_rest();
  if (!arrived && now_ < settle_until_) return;
  post({.kind = LoopEvent::Kind::kDone});
  give_back(trajectory_);
  contact_pending_ = false;
  motion_ = Motion::kHolding;
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

void ControlLoop::give_way() noexcept {
  if (fail_safe_.action() <= Action::kHold || motion_ != Motion::kHolding || gave_way_) return;
  if (!fresh_ || !measured_at_rest() || distance_to_setpoint() <= config_.give_way_tolerance) return;
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    give_way_target_[j] = std::clamp(state_.q[static_cast<Eigen::Index>(j)], config_.limits.lower[j], config_.limits.upper[j]);
  }
  gave_way_ = true;
  motion_ = Motion::kGivingWay;
}

void ControlLoop::start_trajectory() noexcept {
  if (offered_ == nullptr) return;
  using Refusal = LoopEvent::Refusal;
  const Trajectory& offer = *offered_;
  if (moving()) return refuse(offered_, Refusal::kBusy);
  if (fail_safe_.action() != Action::kRun || motion_ != Motion::kHolding || !obeyed()) return refuse(offered_, Refusal::kNotReady);
  if (offer.size == 0 || offer.size > Trajectory::kCapacity || offer.joints != config_.limits.joints || offer.tick != config_.period) {
    return refuse(offered_, Refusal::kBadBuffer);
  }
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    // Written so that NaN is refused.
    if (!(std::abs(offer.points[0].q[j] - setpoint_.q[j]) <= kStartTolerance)) return refuse(offered_, Refusal::kElsewhere);
  }
  trajectory_ = std::exchange(offered_, nullptr);
  cursor_ = -1;
  phase_ = StrokePhase::kAccepted;
  contact_pending_ = false;
  motion_ = Motion::kOnTrajectory;
}

void ControlLoop::anchor() noexcept {
  if (motion_ != Motion::kReleased || !fresh_ || !freshness_.established()) return;
  // Where the arm will be when the command is due. Of the measured speed and the one that the positions show, the slower is believed, and a
  // creeping joint counts as standing: neither noise nor one wrong number is to start a motion.
  const double ahead = to_seconds(due() - state_.stamp);
  const double since = to_seconds(state_.stamp - previous_state_.stamp);
  setpoint_ = {};
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    const double shown = since > 0.0 ? (state_.q[i] - previous_state_.q[i]) / since : 0.0;
    const double speed = std::abs(shown) < std::abs(state_.qd[i]) ? shown : state_.qd[i];
    const bool creeping = std::abs(speed) < config_.rest_speed || shown * state_.qd[i] < 0.0;
    setpoint_.qd[j] = creeping ? 0.0 : std::clamp(speed, -config_.limits.max_speed[j], config_.limits.max_speed[j]);
    setpoint_.q[j] = std::clamp(state_.q[i] + setpoint_.qd[j] * ahead, config_.limits.lower[j], config_.limits.upper[j]);
  }
  anchor_seq_ = seq_ + 1;
  unchecked_ = true;
  motion_ = Motion::kBraking;
}

Setpoint ControlLoop::next_setpoint(std::int64_t periods) noexcept {
  if (unchecked_) return setpoint_;
  switch (motion_) {
    case Motion::kOnTrajectory: return advance_trajectory(periods);
    case Motion::kStoppingOnPath: {
      TrajectoryPoint point;
      bool still_moving = true;
      for (std::int64_t i = 0; i < periods && still_moving; ++i) still_moving = path_stop_.step(point);
      if (!still_moving) {
        give_up_stroke();
        motion_ = Motion::kHolding;
      }
      return to_setpoint(point);
    }
    case Motion::kBraking: {
      const Setpoint next = safety::brake(config_.limits, setpoint_, to_seconds(periods * config_.period));
      if (next.at_rest()) motion_ = Motion::kHolding;
      return next;
    }
    case Motion::kGivingWay: {
      const double span = to_seconds(periods * config_.period);
      const Setpoint next = safety::approach(config_.limits, setpoint_, give_way_target_, config_.give_way_speed, span);
      double left = 0.0;
      for (std::size_t j = 0; j < next.q.size(); ++j) left = std::max(left, std::abs(give_way_target_[j] - next.q[j]));
      if (left < 0.1 * config_.give_way_tolerance) motion_ = Motion::kBraking;
      return next;
    }
    case Motion::kReleased:
    case Motion::kHolding:
    case Motion::kSettling: break;
  }
  return {.q = setpoint_.q, .qd = {}, .qdd = {}};
}

Setpoint ControlLoop::advance_trajectory(std::int64_t periods) noexcept {
  const auto last = static_cast<std::int64_t>(trajectory_->size) - 1;
  const auto contact = static_cast<std::int64_t>(trajectory_->contact_tick);
  const std::int64_t before = cursor_;
  cursor_ = before < 0 ? 0 : std::min(before + periods, last);
  const TrajectoryPoint& point = trajectory_->points[static_cast<std::size_t>(cursor_)];

  if (before < contact && contact <= cursor_) {
    contact_pending_ = true;
    contact_at_ = due() + config_.drive_lag - (cursor_ - contact) * config_.period;
  }
  if (point.phase != phase_) {
    phase_ = point.phase;
    post({.kind = LoopEvent::Kind::kPhase, .phase = phase_});
  }
  if (cursor_ == last) {
    motion_ = Motion::kSettling;
    settle_until_ = due() + config_.drive_lag + config_.max_settle;
  }
  return to_setpoint(point);
}

void ControlLoop::limit(Setpoint& next, std::int64_t periods) noexcept {
  if (std::exchange(unchecked_, false) || motion_ == Motion::kBraking) return;
  const double span = to_seconds(periods * config_.period);
  const auto violation = safety::check_command(config_.limits, setpoint_, next, span);
  if (!violation) return;

  present_.add(Cause::kCommandLimit);
  fail_safe_.update(present_);
  LoopEvent event{.kind = LoopEvent::Kind::kSafety};
  event.causes.add(Cause::kCommandLimit);
  event.violation = violation;
  post(event);
  give_up_stroke();
  motion_ = Motion::kBraking;
  next = safety::brake(config_.limits, setpoint_, span);
}

void ControlLoop::watch_contact() noexcept {
  if (!contact_pending_ || !fresh_ || state_.stamp < contact_at_) return;
  contact_pending_ = false;
  const Duration bracket = state_.stamp - previous_state_.stamp;
  if (previous_state_.stamp > contact_at_ || bracket > kContactBracket || bracket <= Duration::zero()) return;
  const double share = to_seconds(contact_at_ - previous_state_.stamp) / to_seconds(bracket);
  LoopEvent event{.kind = LoopEvent::Kind::kContact};
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    event.q[j] = previous_state_.q[i] + share * (state_.q[i] - previous_state_.q[i]);
    event.qd[j] = previous_state_.qd[i] + share * (state_.qd[i] - previous_state_.qd[i]);
  }
  post(event);
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
  status.recoverable = fail_safe_.recoverable();
  status.stroke_id = trajectory_ != nullptr ? trajectory_->stroke_id : 0;
  status.session = state_.session;
  status.setpoint = setpoint_;
  status.measured_q = to_array(state_.q);
  status.measured_qd = to_array(state_.qd);
  status.states = gate_.counts();
  channels_.status.write(status);
}

void ControlLoop::give_up_stroke() noexcept {
  if (trajectory_ == nullptr) return;
  post({.kind = LoopEvent::Kind::kStopped, .causes = fail_safe_.active()});
  give_back(trajectory_);
  contact_pending_ = false;
}

void ControlLoop::give_back(const Trajectory*& trajectory) noexcept {
  channels_.returns.push(trajectory);
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
  channels_.events.push(event);
}

bool ControlLoop::measured_at_rest() const noexcept { return state_.qd.size() > 0 && state_.qd.cwiseAbs().maxCoeff() < config_.rest_speed; }

double ControlLoop::distance_to_setpoint() const noexcept {
  double distance = 0.0;
  for (Eigen::Index i = 0; i < state_.q.size(); ++i) {
    distance = std::max(distance, std::abs(state_.q[i] - setpoint_.q[static_cast<std::size_t>(i)]));
  }
  return distance;
}

bool ControlLoop::obeyed() const noexcept {
  return motion_ != Motion::kReleased && !state_.braked && state_.command_seq >= anchor_seq_ && state_.command_seq <= seq_;
}

}  // namespace breakshot::control
