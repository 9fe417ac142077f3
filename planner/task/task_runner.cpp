#include "planner/task/task_runner.hpp"

#include "common/outside.hpp"
#include "planner/strategy/sampled_worlds.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>

// TaskRunner from a request to a scene to decide on, and its ends. Strokes are in task_strokes.cpp.

namespace breakshot::task {

namespace {

std::string in_millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", 1e3 * metres);
  return text;
}

/// What is wrong with a task as such; empty when nothing is.
std::string fault_of(const TaskRequest& request) {
  if (!(request.min_gap > 0.0 && request.min_gap <= 0.2))
    return "min_gap: found " + std::to_string(request.min_gap) + "; allowed (0, 0.2] m";
  if (!request.region.min.allFinite() || !request.region.max.allFinite() ||
      !(request.region.min.array() < request.region.max.array()).all()) {
    return "region: min must be below max";
  }
  if (!(request.speed_scale > 0.0 && request.speed_scale <= 1.0)) {
    return "speed_scale: found " + std::to_string(request.speed_scale) + "; allowed (0, 1]";
  }
  if (request.timeout <= Duration::zero()) return "timeout: must be above 0";
  return {};
}

}  // namespace

TaskRunner::TaskRunner(const TaskSettings& settings, std::string strategy_name, std::uint64_t first_stroke_id,
                       const strategy::StrategySettings& knowledge)
    : settings_{settings},
      strategy_name_{std::move(strategy_name)},
      watch_{settings},
      position_sigma_{knowledge.robust.position_sigma},
      ahead_{settings, knowledge},
      belief_{strategy::prior_belief(knowledge)},
      link_{settings, first_stroke_id} {
  status_.smallest_gap = std::numeric_limits<double>::infinity();
}

std::vector<Action> TaskRunner::take_actions() { return std::exchange(actions_, {}); }

// ---- time and status

void TaskRunner::advance(Time now) noexcept {
  // Stamps of several processes meet here, so one may be a little older than the last.
  const Duration passed = std::max(Duration::zero(), now - accounted_to_);
  accounted_to_ = std::max(accounted_to_, now);
  status_.stamp = accounted_to_;
  if (!running() || status_.phase == TaskPhase::kPaused) return;
  unpaused_ += passed;
  switch (status_.phase) {
    case TaskPhase::kLooking: status_.times.look += passed; break;
    case TaskPhase::kDeciding: status_.times.decide += passed; break;
    case TaskPhase::kMoving: status_.times.move += passed; break;
    case TaskPhase::kSettling: status_.times.settle += passed; break;
    default: break;
  }
}

void TaskRunner::set_phase(TaskPhase phase, std::string text) {
  status_.phase = phase;
  status_.text = std::move(text);
  if (status_.text.size() > kTextLimit) status_.text.resize(kTextLimit);
  publish_status();
}

void TaskRunner::publish_status() { actions_.emplace_back(status_); }

// ---- requests

void TaskRunner::on_request(const TaskRequest& request, Time now) {
  advance(now);
  if (request.seq == status_.request_seq && request.order_id == status_.order_id) return;
  if (request.verb == TaskRequest::Verb::kStart) {
    if (!running()) start(request, now);
    return;
  }
  if (request.verb == TaskRequest::Verb::kRecover && !running()) {
    start_recovery(request, now);
    return;
  }
  status_.request_seq = request.seq;
  if (!running() || request.order_id != status_.order_id) {
    publish_status();
    return;
  }
  switch (request.verb) {
    case TaskRequest::Verb::kCancel: end_with({TaskPhase::kCancelled, TaskFailure::kNone, "cancelled as asked"}, now); break;
    case TaskRequest::Verb::kPause:
      pause_asked_ = true;
      drop_waiting_stroke();
      if (!link_.active()) {
        forget_decision();
        set_phase(TaskPhase::kPaused, "paused");
      }
      break;
    case TaskRequest::Verb::kResume:
      pause_asked_ = false;
      if (status_.phase == TaskPhase::kPaused) {
        ahead_.start(now);
        look(now);
      }
      break;
    case TaskRequest::Verb::kStart:
    case TaskRequest::Verb::kRecover: break;
  }
  publish_status();
}

void TaskRunner::begin_status(const TaskRequest& request) {
  const Time stamp = status_.stamp;
  last_tick_ = stamp;
  status_ = {};
  status_.order_id = request.order_id;
  status_.order_rev = request.order_rev;
  status_.request_seq = request.seq;
  status_.stamp = status_.started = stamp;
  status_.smallest_gap = std::numeric_limits<double>::infinity();
}

void TaskRunner::start(const TaskRequest& request, Time now) {
  task_ = request;
  begin_status(request);
  ending_.reset();
  pause_asked_ = false;
  unpaused_ = Duration::zero();
  discs_known_ = request.expect_discs;
  times_before_ = {};
  decisions_ = 0;
  crowd_.clear();
  in_vain_ = 0;
  outcome_due_.reset();
  status_.phase = TaskPhase::kLooking;
  ahead_.start(Time{});  // no stroke runs: pictures that are on their way show the discs where they lie
  if (const std::string fault = fault_of(request); !fault.empty()) {
    finish({TaskPhase::kFailed, TaskFailure::kBadRequest, fault}, now);
    return;
  }
  if (settings_.park_first && !parked_) {
    StrokeRequest park;
    park.kind = StrokeKind::kPark;
    send(park, now);
    set_phase(TaskPhase::kLooking, "parking the arm before the first look");
    return;
  }
  look(now);
}

void TaskRunner::start_recovery(const TaskRequest& request, Time now) {
  begin_status(request);
  StrokeRequest recover;
  recover.kind = StrokeKind::kRecover;
  send(recover, now);
  set_phase(TaskPhase::kRecovering, "asking the controller to recover");
}

// ---- looking

void TaskRunner::look(Time now) {
  if (pause_asked_) {
    set_phase(TaskPhase::kPaused, "paused");
    return;
  }
  watch_.start(now);
  set_phase(outcome_due_ ? TaskPhase::kSettling : TaskPhase::kLooking, "waiting for a scene at rest");
}

void TaskRunner::on_scene(const Scene& scene, Time now) {
  advance(now);
  if (status_.phase == TaskPhase::kDeciding && !link_.active() && !ending_) {
    if (const std::string change = change_while_deciding(scene); !change.empty()) look_again(change, now);
  }
  const bool looking = status_.phase == TaskPhase::kLooking || status_.phase == TaskPhase::kSettling;
  if (!looking || ending_) return;
  const auto verdict = link_.active() ? SceneWatch::Verdict::kIgnored : watch_.on_scene(scene);
  if (verdict != SceneWatch::Verdict::kSettled) think_ahead(scene);
  switch (verdict) {
    case SceneWatch::Verdict::kAtRest:
      if (status_.phase == TaskPhase::kSettling) set_phase(TaskPhase::kLooking, "looking at the table");
      break;
    case SceneWatch::Verdict::kSettled: judge(scene, now); break;
    case SceneWatch::Verdict::kForeign:
      if (status_.text != watch_.trouble()) set_phase(status_.phase, watch_.trouble());
      break;
    case SceneWatch::Verdict::kIgnored:
    case SceneWatch::Verdict::kUnusable:
    case SceneWatch::Verdict::kMoving: break;
  }
}

std::string TaskRunner::change_while_deciding(const Scene& scene) const {
  if (scene.exposed <= scene_.exposed || scene.quality != SceneQuality::kOk) return {};
  if (!scene.foreign.empty()) return "looks again: " + describe(scene.foreign.front());
  // A frame may miss a disc, but none invents one.
  if (scene.discs.size() > scene_.discs.size())
    return "looks again: " + std::to_string(scene.discs.size()) + " discs instead of " + std::to_string(scene_.discs.size());
  const SceneChange change = change_between(scene_, scene, task_.min_gap, position_sigma_);
  if (!change.same_discs || change.in_sigmas <= kSamePlace) return {};
  return "looks again: a disc moved by " + in_millimetres(change.furthest) + " while the stroke was being chosen";
}

bool TaskRunner::watches_table() const noexcept {
  if (status_.phase != TaskPhase::kLooking && status_.phase != TaskPhase::kSettling) return false;
  return !link_.active() || (settings_.plan_ahead && ahead_.started());
}

bool TaskRunner::count_is_right(const Scene& scene) {
  const auto seen = static_cast<std::uint32_t>(scene.discs.size());
  if (task_.expect_discs == 0) discs_known_ = std::max(discs_known_, seen);
  return seen == discs_known_ && seen > 0;
}

void TaskRunner::judge(const Scene& scene, Time now) {
  status_.discs_seen = static_cast<std::uint32_t>(scene.discs.size());
  status_.discs_singulated = spacing_of(scene, task_.min_gap).apart;
  status_.smallest_gap = smallest_gap(scene);
  contacts_left_ = static_cast<std::uint32_t>(
      std::count_if(scene.contacts.begin(), scene.contacts.end(), [](const SceneContact& contact) { return contact.p_touch >= 0.5; }));

  if (!count_is_right(scene)) {
    // One frame may miss a disc; a number that stays wrong is believed.
    if (watch_.scenes_at_rest() < settings_.count_scenes) return;
    const bool moved = status_.hits + status_.pushes > 0;
    const bool fewer = status_.discs_seen < discs_known_;
    if (moved && fewer) status_.discs_lost = discs_known_ - status_.discs_seen;
    const std::string text = discs_known_ == 0
                                 ? "no disc on the table"
                                 : "found " + std::to_string(status_.discs_seen) + " discs; expected " + std::to_string(discs_known_);
    if (outcome_due_) emit_outcome(*outcome_due_);
    fail(moved && fewer ? TaskFailure::kDiscLost : TaskFailure::kWrongDiscCount, text, now);
    return;
  }

  status_.discs_lost = static_cast<std::uint32_t>(count_outside(scene.discs, task_.region));
  if (outcome_due_) {
    if (stroke_run_.kind == StrokeKind::kHit && outcome_due_->phase == StrokePhase::kDone) {
      actions_.emplace_back(estimate::ObservedHit{scene_, scene, stroke_run_, outcome_due_->contact_speed});
    }
    emit_outcome(*outcome_due_);
  }
  if (status_.smallest_gap >= task_.min_gap && status_.discs_lost == 0) {
    const std::string gap = status_.discs_seen < 2 ? "one disc alone" : "smallest gap " + in_millimetres(status_.smallest_gap);
    ahead_.not_needed();
    finish({TaskPhase::kSingulated, TaskFailure::kNone, "singulated: " + gap}, now);
    return;
  }
  scene_ = scene;
  if (gives_up_on_crowd(now)) return;
  hit_speed_cap_ = std::numeric_limits<double>::max();
  conclude(now);
}

// ---- ends

void TaskRunner::on_tick(Time now, Duration real) {
  const Duration passed = std::clamp(now - last_tick_, Duration::zero(), real);
  last_tick_ = std::max(last_tick_, now);
  advance(now);
  if (!running()) return;
  switch (link_.check(now, passed)) {
    case StrokeLink::Need::kSend: actions_.emplace_back(SendStroke{link_.request()}); break;
    case StrokeLink::Need::kGiveUp: {
      const auto& said = link_.status();
      std::string text = "the controller does not answer";
      if (said)
        text = link_.waits() ? std::string{"the controller stays "} + to_string(said->reason) + ": " + said->text
                             : "the controller stays silent";
      link_.end();
      finish({TaskPhase::kFailed, TaskFailure::kControllerFault, text}, now);
      return;
    }
    case StrokeLink::Need::kNothing: break;
  }
  if (status_.phase == TaskPhase::kPaused || status_.phase == TaskPhase::kRecovering || ending_) return;
  if (unpaused_ > task_.timeout) {
    end_with({TaskPhase::kFailed, TaskFailure::kTimeout, "not singulated within " + std::to_string(to_seconds(task_.timeout)) + " s"}, now);
    return;
  }
  const bool looking = status_.phase == TaskPhase::kLooking || status_.phase == TaskPhase::kSettling;
  if (!looking || link_.active()) return;
  watch_.wait(passed);
  if (watch_.silent()) {
    fail(watch_.foreign() ? TaskFailure::kForeignObject : TaskFailure::kNoScene,
         watch_.trouble().empty() ? "no scene comes from perception" : watch_.trouble(), now);
  } else if (watch_.restless(now)) {
    fail(TaskFailure::kNoScene, "the discs do not come to rest: " + watch_.motion(), now);
  }
}

void TaskRunner::on_clock_stopped(Time now) {
  advance(now);
  if (!running()) return;
  const bool controller = link_.active();
  link_.end();
  const std::string text = "the cell clock stands still: neither a scene nor a stroke status comes";
  finish({TaskPhase::kFailed, controller ? TaskFailure::kControllerFault : TaskFailure::kNoScene, text}, now);
}

void TaskRunner::end_with(End end, Time now) {
  if (ending_ && end.phase != TaskPhase::kCancelled) return;
  forget_decision();
  ending_ = std::move(end);
  drop_waiting_stroke();
  if (link_.active()) return;  // the stroke runs to its end; stroke_over() goes on
  if (parked_) {
    finish(End{*ending_}, now);
    return;
  }
  StrokeRequest park;
  park.kind = StrokeKind::kPark;
  send(park, now);
  set_phase(TaskPhase::kSettling, "the arm parks");
}

void TaskRunner::fail(TaskFailure failure, std::string text, Time now) { end_with({TaskPhase::kFailed, failure, std::move(text)}, now); }

void TaskRunner::finish(const End& end, Time /*now*/) {
  ending_.reset();
  pause_asked_ = false;
  forget_decision();
  status_.failure = end.failure;
  status_.ended = status_.stamp;
  set_phase(end.phase, end.phase == TaskPhase::kFailed && !crowd_.empty() ? crowd_ + "; " + end.text : end.text);
}

}  // namespace breakshot::task
