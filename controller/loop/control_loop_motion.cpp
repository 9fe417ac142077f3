#include "controller/loop/control_loop.hpp"

#include "controller/safety/command_limiter.hpp"
#include "controller/safety/joint_brake.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

// The half of the control loop that moves the set-point. What decides that it moves is in control_loop.cpp.

namespace breakshot::control {

using motion::TrajectoryPoint;
using safety::Action;
using safety::Cause;
using safety::Setpoint;

namespace {

/// Nearer to the contact than this a measurement may already hold the impact, which takes up to a seventh of the speed within a tick: the hits that
/// the cell asks for, 0.3 m/s and faster, cover in this time what a disc may stand nearer than it is thought to, 1 mm.
constexpr Duration kUndisturbed = std::chrono::milliseconds{3};
/// A measurement this long before the contact says little of it.
constexpr Duration kOldestApproach = std::chrono::milliseconds{20};

Setpoint to_setpoint(const TrajectoryPoint& point) noexcept { return {point.q, point.qd, point.qdd}; }

}  // namespace

void ControlLoop::settle() noexcept {
  if (motion_ != Motion::kSettling) return;
  const bool arrived = fresh_ && state_.stamp + config_.max_settle >= settle_until_ && measured_at_rest();
  if (!arrived && now_ < settle_until_) return;
  post({.kind = LoopEvent::Kind::kDone});
  give_back(trajectory_);
  contact_pending_ = false;
  motion_ = Motion::kHolding;
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

void ControlLoop::anchor() noexcept {
  if (motion_ != Motion::kReleased || !fresh_ || !freshness_.established()) return;
  // Where the arm will be when the command is due. Of the measured speed and the one that the positions show, the slower is believed, and a
  // creeping joint counts as standing: neither noise nor one wrong number is to start a motion.
  const double ahead = to_seconds(due() - state_.stamp);
  const double since = to_seconds(state_.stamp - past_states_.front().stamp);
  setpoint_ = {};
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    const double shown = since > 0.0 ? (state_.q[i] - past_states_.front().q[i]) / since : 0.0;
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
    case Motion::kPaced: return advance_paced(periods);
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
  std::int64_t before = cursor_;
  std::int64_t now = before < 0 ? 0 : before + periods;
  if (next_trajectory_ != nullptr && now >= join_tick_) {
    join();
    before -= join_tick_;
    now -= join_tick_;
  }
  const auto last = static_cast<std::int64_t>(trajectory_->size) - 1;
  const auto contact = static_cast<std::int64_t>(trajectory_->contact_tick);
  cursor_ = std::min(now, last);
  const TrajectoryPoint& point = trajectory_->points[static_cast<std::size_t>(cursor_)];

  if (before < contact && contact <= cursor_) {
    contact_pending_ = true;
    contact_at_ = due() + config_.drive_lag - (cursor_ - contact) * config_.period;
  }
  enter(point.phase);
  if (cursor_ == last) begin_to_settle();
  return to_setpoint(point);
}

Setpoint ControlLoop::advance_paced(std::int64_t periods) noexcept {
  const double before = path_pace_.path_position();
  TrajectoryPoint point;
  bool still_moving = true;
  for (std::int64_t i = 0; i < periods; ++i) still_moving = path_pace_.step(point);
  const double now = path_pace_.path_position();
  cursor_ = static_cast<std::int64_t>(now);

  const auto contact = static_cast<double>(trajectory_->contact_tick);
  if (before < contact && contact <= now) {
    contact_pending_ = true;
    const double share = (now - contact) / (now - before);
    contact_at_ = due() + config_.drive_lag - from_seconds(share * to_seconds(periods * config_.period));
  }
  enter(point.phase);
  if (!still_moving && fail_safe_.action() > Action::kHold) {
    give_up_stroke();
    motion_ = Motion::kHolding;
  } else if (path_pace_.at_end()) {
    begin_to_settle();
  }
  return to_setpoint(point);
}

void ControlLoop::join() noexcept {
  post({.kind = LoopEvent::Kind::kDone, .joined = true});
  give_back(trajectory_);
  contact_pending_ = false;
  trajectory_ = std::exchange(next_trajectory_, nullptr);
  trajectory_number_ = std::exchange(next_number_, 0);
  phase_ = StrokePhase::kAccepted;
}

void ControlLoop::drop_missed() noexcept {
  using Refusal = LoopEvent::Refusal;
  if (next_trajectory_ == nullptr || joinable() != 0) return;
  refuse(next_trajectory_, fail_safe_.action() > Action::kHold ? Refusal::kNotReady : Refusal::kMissed);
}

void ControlLoop::enter(StrokePhase phase) noexcept {
  if (phase == phase_) return;
  phase_ = phase;
  post({.kind = LoopEvent::Kind::kPhase, .phase = phase});
}

void ControlLoop::begin_to_settle() noexcept {
  motion_ = Motion::kSettling;
  settle_until_ = due() + config_.drive_lag + config_.max_settle;
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
  // The newest good state before it that no disc can have disturbed.
  const auto approach = std::find_if(past_states_.begin(), past_states_.end(),
                                     [&](const JointState& state) { return state.stamp + kUndisturbed <= contact_at_; });
  if (approach == past_states_.end() || contact_at_ - approach->stamp > kOldestApproach) return;
  const auto then = following_.commanded(approach->stamp - config_.drive_lag);
  const auto at_contact = following_.commanded(contact_at_ - config_.drive_lag);
  if (!then || !at_contact) return;
  LoopEvent event{.kind = LoopEvent::Kind::kContact};
  for (std::size_t j = 0; j < static_cast<std::size_t>(config_.limits.joints); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    event.q[j] = approach->q[i] + at_contact->q[j] - then->q[j];
    event.qd[j] = approach->qd[i] + at_contact->qd[j] - then->qd[j];
  }
  post(event);
}

double ControlLoop::distance_to_setpoint() const noexcept {
  double distance = 0.0;
  for (Eigen::Index i = 0; i < state_.q.size(); ++i) {
    distance = std::max(distance, std::abs(state_.q[i] - setpoint_.q[static_cast<std::size_t>(i)]));
  }
  return distance;
}

bool ControlLoop::measured_at_rest() const noexcept { return state_.qd.size() > 0 && state_.qd.cwiseAbs().maxCoeff() < config_.rest_speed; }

}  // namespace breakshot::control
