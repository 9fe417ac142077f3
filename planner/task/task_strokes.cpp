#include "planner/task/task_runner.hpp"

#include <algorithm>
#include <utility>

// TaskRunner from a decision until the stroke has been run. Decisions are in task_decisions.cpp, the rest in task_runner.cpp.

namespace breakshot::task {

namespace {

constexpr std::size_t kCandidates = 5;  // Plan::candidates

/// An attainable speed is asked for with this much to spare, lest rounding have it refused again.
constexpr double kBelowAttainable = 0.98;

}  // namespace

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
  plan.why = option.why + (ahead_note_.empty() ? "" : "; " + ahead_note_);
  plan.why.resize(std::min(plan.why.size(), kTextLimit));
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
  if (stroke.kind != StrokeKind::kPark) ahead_.stop();
  actions_.emplace_back(SendStroke{link_.begin(stroke, now)});
}

void TaskRunner::on_stroke_status(const StrokeStatus& status, Time now) {
  advance(now);
  if (!link_.on_status(status)) return;
  if (is_final(status.phase)) {
    // A controller that is busy or not ready is asked again (on_tick()), unless the stroke is no longer wanted.
    const bool unwanted = link_.request().kind != StrokeKind::kPark && (ending_ || pause_asked_);
    if (link_.request().kind == StrokeKind::kRecover) {
      recovery_over(now);
    } else if (!link_.waits() || unwanted) {
      stroke_over(now);
    }
    return;
  }
  const bool stroke = link_.request().kind != StrokeKind::kPark;
  if (stroke && status.phase == StrokePhase::kParking && status_.phase == TaskPhase::kMoving) {
    ahead_.start(now);
    set_phase(TaskPhase::kSettling, "the discs are free, the arm parks");
  }
}

void TaskRunner::drop_waiting_stroke() {
  if (!link_.active() || !link_.waits() || link_.request().kind == StrokeKind::kPark) return;
  link_.end();
  parked_ = parked_before_;
}

void TaskRunner::recovery_over(Time now) {
  const StrokeStatus status = *link_.status();
  link_.end();
  parked_ = false;
  if (status.phase == StrokePhase::kDone) {
    finish({TaskPhase::kRecovered, TaskFailure::kNone, status.text}, now);
  } else {
    finish({TaskPhase::kFailed, TaskFailure::kControllerFault, status.text}, now);
  }
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
  if (status.phase == StrokePhase::kStopped) {
    // The arm stands somewhere over the table, and a park request would be refused: the controller waits for a recovery.
    parked_ = false;
    emit_outcome(status);
    finish({TaskPhase::kFailed, TaskFailure::kControllerFault, "the stroke was stopped: " + status.text}, now);
    return;
  }
  outcome_due_ = status;
  stroke_run_ = stroke;
  if (!ahead_.started()) ahead_.start(now);
  parked_ = stroke.park_after;
  if (!parked_) {
    StrokeRequest park;
    park.kind = StrokeKind::kPark;
    send(park, now);
    set_phase(TaskPhase::kSettling, "the arm parks");
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
  if (status.reason == RefusalReason::kStopped) {
    parked_ = false;
    finish({TaskPhase::kFailed, TaskFailure::kControllerFault, "the controller is stopped: " + status.text}, now);
    return;
  }
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
    ask_strategy();
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

}  // namespace breakshot::task
