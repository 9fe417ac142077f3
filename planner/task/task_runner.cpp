#include "planner/task/task_runner.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace breakshot::task {

namespace {

constexpr std::size_t kTextLimit = 255;  // TaskStatus::text, Plan::why
constexpr std::size_t kCandidates = 5;   // Plan::candidates

/// An attainable speed is asked for with this much to spare, lest rounding have it refused again.
constexpr double kBelowAttainable = 0.98;

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

/// Discs that keep min_gap to every other one.
std::uint32_t singulated_discs(const Scene& scene, double min_gap) {
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < scene.discs.size(); ++i) {
    bool apart = true;
    for (std::size_t j = 0; j < scene.discs.size() && apart; ++j) {
      const auto& a = scene.discs[i];
      const auto& b = scene.discs[j];
      apart = i == j || (a.p_WD - b.p_WD).norm() - a.radius - b.radius >= min_gap;
    }
    count += apart ? 1 : 0;
  }
  return count;
}

std::uint32_t discs_outside(const Scene& scene, const Rect& region) {
  std::uint32_t count = 0;
  for (const auto& disc : scene.discs) count += region.contains(disc.p_WD) ? 0 : 1;
  return count;
}

}  // namespace

TaskRunner::TaskRunner(const TaskSettings& settings, std::string strategy_name, std::uint64_t first_stroke_id)
    : settings_{settings}, strategy_name_{std::move(strategy_name)}, watch_{settings}, link_{settings, first_stroke_id} {
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
        ++ticket_;  // a decision under way is not waited for
        set_phase(TaskPhase::kPaused, "paused");
      }
      break;
    case TaskRequest::Verb::kResume:
      pause_asked_ = false;
      if (status_.phase == TaskPhase::kPaused) look(now);
      break;
    case TaskRequest::Verb::kStart: break;
  }
  publish_status();
}

void TaskRunner::start(const TaskRequest& request, Time now) {
  task_ = request;
  const Time stamp = status_.stamp;
  status_ = {};
  status_.order_id = request.order_id;
  status_.order_rev = request.order_rev;
  status_.request_seq = request.seq;
  status_.stamp = status_.started = stamp;
  status_.smallest_gap = std::numeric_limits<double>::infinity();
  ending_.reset();
  pause_asked_ = false;
  unpaused_ = Duration::zero();
  discs_known_ = request.expect_discs;
  times_before_ = {};
  decisions_ = 0;
  stops_ = 0;
  outcome_due_.reset();
  status_.phase = TaskPhase::kLooking;
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
  const bool looking = status_.phase == TaskPhase::kLooking || status_.phase == TaskPhase::kSettling;
  if (!looking || link_.active() || ending_) return;
  switch (watch_.on_scene(scene, now)) {
    case SceneWatch::Verdict::kAtRest:
      if (status_.phase == TaskPhase::kSettling) set_phase(TaskPhase::kLooking, "looking at the table");
      break;
    case SceneWatch::Verdict::kSettled: judge(scene, now); break;
    case SceneWatch::Verdict::kIgnored:
    case SceneWatch::Verdict::kUnusable:
    case SceneWatch::Verdict::kMoving: break;
  }
}

bool TaskRunner::count_is_right(const Scene& scene) {
  const auto seen = static_cast<std::uint32_t>(scene.discs.size());
  if (task_.expect_discs == 0) discs_known_ = std::max(discs_known_, seen);
  return seen == discs_known_ && seen > 0;
}

void TaskRunner::judge(const Scene& scene, Time now) {
  status_.discs_seen = static_cast<std::uint32_t>(scene.discs.size());
  status_.discs_singulated = singulated_discs(scene, task_.min_gap);
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

  status_.discs_lost = discs_outside(scene, task_.region);
  if (outcome_due_) emit_outcome(*outcome_due_);
  if (status_.discs_lost > 0) {
    fail(TaskFailure::kDiscLost,
         std::to_string(status_.discs_lost) + " of " + std::to_string(status_.discs_seen) + " discs rest outside the region", now);
    return;
  }
  if (status_.smallest_gap >= task_.min_gap) {
    const std::string gap = status_.discs_seen < 2 ? "one disc alone" : "smallest gap " + in_millimetres(status_.smallest_gap);
    finish({TaskPhase::kSingulated, TaskFailure::kNone, "singulated: " + gap}, now);
    return;
  }
  scene_ = scene;
  hit_speed_cap_ = std::numeric_limits<double>::max();
  ask_strategy(now);
}

// ---- deciding

void TaskRunner::ask_strategy(Time /*now*/) {
  strategy::DecisionContext context;
  context.min_gap = task_.min_gap;
  context.region = task_.region;
  context.hits_left = task_.max_hits - std::min(task_.max_hits, status_.hits);
  context.pushes_left = task_.max_pushes - std::min(task_.max_pushes, status_.pushes);
  context.speed_scale = task_.speed_scale;
  context.hit_speed_cap = hit_speed_cap_;
  context.seed = settings_.seed * 0x9E3779B97F4A7C15U + decisions_++;
  set_phase(TaskPhase::kDeciding, "deciding");
  actions_.emplace_back(RunStrategy{++ticket_, scene_, context});
}

void TaskRunner::on_decision(std::uint64_t ticket, strategy::Decision decision, Duration think, Time now) {
  advance(now);
  if (ticket != ticket_ || status_.phase != TaskPhase::kDeciding || ending_) return;
  switch (decision.kind) {
    case strategy::Decision::Kind::kSingulated:
      // The task saw a gap below G in the same scene: the two differ by rounding, and another look decides.
      look(now);
      return;
    case strategy::Decision::Kind::kNoStroke:
      fail(status_.pushes >= task_.max_pushes ? TaskFailure::kStrokeLimit : TaskFailure::kNoFeasibleStroke, decision.why, now);
      return;
    case strategy::Decision::Kind::kStroke: break;
  }
  options_ = std::move(decision.options);
  option_ = 0;
  think_ = think;
  try_next_option(now);
}

void TaskRunner::try_next_option(Time now) {
  if (option_ >= options_.size()) {
    fail(TaskFailure::kNoFeasibleStroke, "all " + std::to_string(options_.size()) + " strokes were refused; the last: " + status_.text,
         now);
    return;
  }
  const auto& option = options_[option_++];
  send(option.stroke, now);

  Plan plan;
  plan.seq = ++plans_;
  plan.order_id = task_.order_id;
  plan.stamp = status_.stamp;
  plan.scene_seq = scene_.seq;
  plan.strategy = strategy_name_;
  plan.stroke = link_.request();
  plan.why = option.why.substr(0, kTextLimit);
  plan.predicted_gap = option.predicted_gap;
  plan.predicted_p_WD = option.predicted_p_WD;
  for (std::size_t k = option_ - 1; k < options_.size() && plan.candidates.size() < kCandidates; ++k) {
    plan.candidates.push_back({options_[k].stroke, options_[k].cost_s, options_[k].p_singulated, options_[k].p_lost});
    plan.candidates.back().stroke.id = plan.stroke.id;  // that it would have had
  }
  plan.think = think_;
  actions_.emplace_back(std::move(plan));
  set_phase(TaskPhase::kMoving, option.why);
}

// ---- moving

void TaskRunner::send(const StrokeRequest& stroke, Time now) {
  parked_before_ = parked_;
  parked_ = false;
  actions_.emplace_back(SendStroke{link_.begin(stroke, now)});
}

void TaskRunner::on_stroke_status(const StrokeStatus& status, Time now) {
  advance(now);
  if (!link_.on_status(status, now)) return;
  if (is_final(status.phase)) {
    // A controller that is busy or not ready is asked again (on_tick()), unless the stroke is no longer wanted.
    const bool unwanted = link_.request().kind != StrokeKind::kPark && (ending_ || pause_asked_);
    if (!link_.waits() || unwanted) stroke_over(now);
    return;
  }
  const bool stroke = link_.request().kind != StrokeKind::kPark;
  if (stroke && status.phase == StrokePhase::kParking && status_.phase == TaskPhase::kMoving) {
    set_phase(TaskPhase::kSettling, "the discs are free, the arm parks");
  }
}

void TaskRunner::drop_waiting_stroke() {
  if (!link_.active() || !link_.waits() || link_.request().kind == StrokeKind::kPark) return;
  link_.end();
  parked_ = parked_before_;
}

void TaskRunner::stroke_over(Time now) {
  const StrokeStatus status = *link_.status();
  const StrokeRequest stroke = link_.request();
  link_.end();
  if (stroke.kind == StrokeKind::kPark) {
    if (status.phase == StrokePhase::kDone) {
      parked_ = true;
      if (ending_) {
        finish(End{*ending_}, now);
      } else {
        look(now);
      }
      return;
    }
    finish({TaskPhase::kFailed, TaskFailure::kControllerFault,
            std::string{"the arm does not park: "} +
                (status.phase == StrokePhase::kRefused ? to_string(status.reason) : "stopped on the way") +
                (status.text.empty() ? "" : ", " + status.text)},
           now);
    return;
  }
  if (status.phase == StrokePhase::kRefused) {
    refused(status, now);
    return;
  }

  ++(stroke.kind == StrokeKind::kHit ? status_.hits : status_.pushes);
  outcome_due_ = status;
  const bool stopped = status.phase == StrokePhase::kStopped;
  parked_ = !stopped && stroke.park_after;
  stops_ = stopped ? stops_ + 1 : 0;
  if (stops_ >= settings_.stops_in_a_row && !ending_) {
    ending_ = End{TaskPhase::kFailed, TaskFailure::kControllerFault, "strokes keep being stopped: " + status.text};
  }
  if (!parked_) {
    StrokeRequest park;
    park.kind = StrokeKind::kPark;
    send(park, now);
    set_phase(TaskPhase::kSettling, stopped ? "the stroke was stopped: " + status.text : "the arm parks");
  } else if (ending_) {
    finish(End{*ending_}, now);
  } else {
    look(now);
  }
}

void TaskRunner::refused(const StrokeStatus& status, Time now) {
  emit_outcome(status);
  parked_ = parked_before_;  // a refused stroke does not move the arm
  status_.text = std::string{to_string(status.reason)} + (status.text.empty() ? "" : ": " + status.text);
  if (ending_) {
    finish(End{*ending_}, now);
    return;
  }
  if (pause_asked_) {
    set_phase(TaskPhase::kPaused, "paused");
    return;
  }
  const double cap = kBelowAttainable * status.attainable;
  if (status.reason == RefusalReason::kTooFast && cap > 0.0 && cap < hit_speed_cap_) {
    // The virtual world picks a speed again among those that the arm attains there.
    hit_speed_cap_ = cap;
    ask_strategy(now);
    return;
  }
  try_next_option(now);
}

void TaskRunner::emit_outcome(const StrokeStatus& status) {
  Outcome outcome;
  outcome.plan_seq = plans_;
  outcome.stroke_id = status.id;
  outcome.stamp = status_.stamp;
  outcome.stroke_phase = status.phase;
  outcome.reason = status.reason;
  outcome.achieved_gap = status_.smallest_gap;
  outcome.discs_singulated = status_.discs_singulated;
  outcome.discs_lost = status_.discs_lost;
  outcome.contacts_left = contacts_left_;
  outcome.contact_speed = status.contact_speed;
  outcome.times = {status_.times.look - times_before_.look, status_.times.decide - times_before_.decide,
                   status_.times.move - times_before_.move, status_.times.settle - times_before_.settle};
  times_before_ = status_.times;
  outcome_due_.reset();
  actions_.emplace_back(outcome);
}

// ---- ends

void TaskRunner::on_tick(Time now) {
  advance(now);
  if (!running()) return;
  switch (link_.check(now)) {
    case StrokeLink::Need::kSend: actions_.emplace_back(SendStroke{link_.request()}); break;
    case StrokeLink::Need::kGiveUp: {
      const auto& said = link_.status();
      const std::string text = said ? std::string{"the controller stays "} + (link_.waits() ? to_string(said->reason) : "silent")
                                    : "the controller does not answer";
      link_.end();
      finish({TaskPhase::kFailed, TaskFailure::kControllerFault, text}, now);
      return;
    }
    case StrokeLink::Need::kNothing: break;
  }
  if (status_.phase == TaskPhase::kPaused || ending_) return;
  if (unpaused_ > task_.timeout) {
    end_with({TaskPhase::kFailed, TaskFailure::kTimeout, "not singulated within " + std::to_string(to_seconds(task_.timeout)) + " s"}, now);
    return;
  }
  const bool looking = status_.phase == TaskPhase::kLooking || status_.phase == TaskPhase::kSettling;
  if (!looking || link_.active()) return;
  if (watch_.silent(now)) {
    fail(TaskFailure::kNoScene, watch_.trouble().empty() ? "no scene comes from perception" : watch_.trouble(), now);
  } else if (watch_.restless(now)) {
    fail(TaskFailure::kNoScene, "the discs do not come to rest", now);
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
  ++ticket_;  // a decision under way no longer counts
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
  ++ticket_;
  status_.failure = end.failure;
  status_.ended = status_.stamp;
  set_phase(end.phase, end.text);
}

}  // namespace breakshot::task
