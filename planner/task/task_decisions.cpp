#include "planner/task/task_runner.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <utility>

// TaskRunner's decisions: ahead of the scene that settles, and on it. Looking and ends are in task_runner.cpp, strokes in task_strokes.cpp.

namespace breakshot::task {

namespace {

/// With more discs than fit, the task ends when so many strokes in a row brought no more of them apart.
constexpr int kMostInVain = 3;

/// Which discs rest outside a region, for people.
std::string outside_text(const Scene& scene, const Rect& region) {
  std::string all;
  for (std::size_t i = 0; i < scene.discs.size(); ++i) {
    const Vector2& p_WD = scene.discs[i].p_WD;
    if (region.contains(p_WD)) continue;
    char text[80];
    std::snprintf(text, sizeof text, "disc %zu at (%.3f, %.3f) m rests outside the region", i + 1, p_WD.x(), p_WD.y());
    all += (all.empty() ? "" : ", ") + std::string{text};
  }
  return all;
}

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

bool TaskRunner::gives_up_on_crowd(Time now) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const SceneDisc& disc : scene_.discs) smallest = std::min(smallest, disc.radius);
  const std::uint32_t most = most_that_fit(task_.region, smallest, task_.min_gap);
  if (status_.discs_seen <= most) return false;
  const bool first = crowd_.empty();
  char text[128];
  std::snprintf(text, sizeof text, "%u discs, of which at most %u fit the region with gaps of %.1f mm", status_.discs_seen, most,
                1e3 * task_.min_gap);
  crowd_ = text;
  const Spacing spacing = spacing_of(scene_, task_.min_gap);
  const bool gained = first || spacing.better_than(best_);
  in_vain_ = gained ? 0 : in_vain_ + 1;
  if (gained) best_ = spacing;
  if (in_vain_ < kMostInVain) return false;
  fail(TaskFailure::kNoFeasibleStroke,
       std::to_string(status_.discs_singulated) + " stand apart, and more were not gained by the last strokes", now);
  return true;
}

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
        fail(TaskFailure::kDiscLost, outside_text(scene_, task_.region) + "; " + decision.why, now);
        return;
      }
      fail(status_.pushes >= task_.max_pushes ? TaskFailure::kStrokeLimit : TaskFailure::kNoFeasibleStroke, decision.why, now);
      return;
    case strategy::Decision::Kind::kStroke: break;
  }
  options_ = std::move(decision.options);
  option_ = 0;
  think_ = think;
  if (!crowd_.empty()) {
    // They cannot all stand apart. A stroke that does not bring them nearer to it may undo what was gained.
    const Spacing now_is = spacing_of(scene_, task_.min_gap);
    std::erase_if(options_, [&](const strategy::StrokeOption& option) {
      return option.predicted_p_WD.size() == scene_.discs.size() &&
             !spacing_of(scene_, option.predicted_p_WD, task_.min_gap).better_than(now_is);
    });
    if (options_.empty()) {
      fail(TaskFailure::kNoFeasibleStroke, std::to_string(status_.discs_singulated) + " stand apart, and no stroke promises more", now);
      return;
    }
  }
  try_next_option(now);
}

}  // namespace breakshot::task
