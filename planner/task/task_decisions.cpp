#include "planner/task/task_runner.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>

// TaskRunner's decisions: ahead of the scene that settles, and on it. Looking and ends are in task_runner.cpp, strokes in task_strokes.cpp.

namespace breakshot::task {

namespace {

std::string correction(const StrokeRequest& before, const StrokeRequest& after) {
  if (before.kind != after.kind || before.direction_W.dot(after.direction_W) < 0.9) return ": another stroke";
  char text[48];
  std::snprintf(text, sizeof text, ": stroke moved by %.2f mm", 1e3 * (after.p_WS - before.p_WS).norm());
  return text;
}

}  // namespace

// ---- ahead of the scene

void TaskRunner::think_ahead(const Scene& scene) {
  if (!settings_.plan_ahead || pause_asked_ || ending_) return;
  auto question = ahead_.on_scene(scene, discs_known_, task_.min_gap, task_.region, belief_);
  if (!question) return;
  strategy::DecisionContext context = this->context();
  context.hit_speed_cap = std::numeric_limits<double>::max();  // what was found of the last stroke is not about this one
  if (context.hits_left == 0 && context.pushes_left == 0) return;
  ahead_.asked(*question, ++ticket_);
  actions_.emplace_back(RunStrategy{ticket_, std::move(question->scene), context, std::move(question->earlier)});
}

void TaskRunner::conclude(Time now) {
  ahead_verdict_ = ahead_.settle(scene_, task_.min_gap);
  if (ahead_verdict_ == PlanAhead::Verdict::kNone) {
    ask_strategy();
    return;
  }
  set_phase(TaskPhase::kDeciding, "deciding since before the scene settled");
  if (ahead_.answered()) use_ahead(now);
}

void TaskRunner::use_ahead(Time now) {
  const auto verdict = std::exchange(ahead_verdict_, PlanAhead::Verdict::kNone);
  // What is kept was decided on these places; the settled ones differ by what the camera errs.
  if (verdict == PlanAhead::Verdict::kKeep) scene_.discs = ahead_.scene().discs;
  Duration think{};
  strategy::Decision decision = ahead_.take_decision(think);
  // That a forecast leaves nothing to do, or to do it with, ends no task.
  if (decision.kind != strategy::Decision::Kind::kStroke) {
    ask_strategy();
    return;
  }
  if (verdict == PlanAhead::Verdict::kCorrect) {
    ask_strategy(std::move(decision.options));
    think_ahead_ = think;
    return;
  }
  ahead_note_ = ahead_.note();
  decided(std::move(decision), think, now);
}

void TaskRunner::forget_decision() {
  ++ticket_;
  ahead_.stop();
  ahead_verdict_ = PlanAhead::Verdict::kNone;
}

void TaskRunner::look_again(const std::string& why, Time now) {
  forget_decision();
  ahead_.start(now);
  look(now);
  set_phase(status_.phase, why);
}

// ---- on the scene

strategy::DecisionContext TaskRunner::context() const {
  // A stroke that is not over yet has been made all the same.
  const auto left = [&](StrokeKind kind, std::uint32_t most, std::uint32_t made) {
    made += link_.active() && link_.request().kind == kind ? 1 : 0;
    return most - std::min(most, made);
  };
  strategy::DecisionContext context;
  context.min_gap = task_.min_gap;
  context.region = task_.region;
  context.hits_left = left(StrokeKind::kHit, task_.max_hits, status_.hits);
  context.pushes_left = left(StrokeKind::kPush, task_.max_pushes, status_.pushes);
  context.speed_scale = task_.speed_scale;
  context.hit_speed_cap = hit_speed_cap_;
  context.seed = settings_.seed * 0x9E3779B97F4A7C15U + decisions_;
  return context;
}

void TaskRunner::ask_strategy(std::vector<strategy::StrokeOption> earlier) {
  ahead_note_.clear();
  think_ahead_ = Duration::zero();
  corrected_.reset();
  if (!earlier.empty()) {
    ahead_note_ = ahead_.note();
    corrected_ = earlier.front().stroke;
  }
  set_phase(TaskPhase::kDeciding, earlier.empty() ? "deciding" : "correcting what was decided before the scene settled");
  actions_.emplace_back(RunStrategy{++ticket_, scene_, context(), std::move(earlier)});
}

void TaskRunner::on_decision(std::uint64_t ticket, strategy::Decision decision, Duration think, Time now) {
  advance(now);
  if (ticket != ticket_ || ending_) return;
  if (ahead_.take(ticket, decision, think)) {
    if (ahead_verdict_ != PlanAhead::Verdict::kNone) use_ahead(now);
    return;
  }
  if (status_.phase != TaskPhase::kDeciding) return;
  if (corrected_ && decision.kind != strategy::Decision::Kind::kStroke) {
    ask_strategy();  // none of the strokes that were to be corrected will do here
    return;
  }
  if (corrected_) ahead_note_ += correction(*corrected_, decision.options.front().stroke);
  decided(std::move(decision), think_ahead_ + think, now);
}

void TaskRunner::decided(strategy::Decision decision, Duration think, Time now) {
  ++decisions_;
  switch (decision.kind) {
    case strategy::Decision::Kind::kSingulated:
      // The task saw a gap below G in the same scene: the two differ by rounding, and another look decides.
      ahead_.start(now);
      look(now);
      return;
    case strategy::Decision::Kind::kNoStroke:
      // A disc outside that the strategy does not bring back is lost, whatever else stands in the way.
      if (status_.discs_lost > 0) {
        fail(TaskFailure::kDiscLost, decision.why, now);
        return;
      }
      fail(status_.pushes >= task_.max_pushes ? TaskFailure::kStrokeLimit : TaskFailure::kNoFeasibleStroke, decision.why, now);
      return;
    case strategy::Decision::Kind::kStroke: break;
  }
  options_ = std::move(decision.options);
  option_ = 0;
  think_ = think;
  try_next_option(now);
}

}  // namespace breakshot::task
