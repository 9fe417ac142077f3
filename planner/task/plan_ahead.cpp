#include "planner/task/plan_ahead.hpp"

#include "common/outside.hpp"

#include <cstdio>
#include <utility>

namespace breakshot::task {

PlanAhead::PlanAhead(const TaskSettings& settings, const strategy::StrategySettings& knowledge)
    : settings_{settings}, position_sigma_{knowledge.robust.position_sigma}, forecast_{knowledge, settings.settle_speed} {}

void PlanAhead::start(Time now) {
  stop();
  since_ = now;
  forecast_.start();
}

void PlanAhead::stop() {
  since_.reset();
  draft_.reset();
}

std::optional<PlanAhead::Question> PlanAhead::on_scene(const Scene& scene, std::size_t discs, double min_gap, const Rect& region,
                                                       const strategy::TableBelief& belief) {
  if (!since_ || scene.exposed <= *since_) return std::nullopt;
  if (scene.quality != SceneQuality::kOk || !scene.foreign.empty()) {
    start(scene.exposed);
    return std::nullopt;
  }
  forecast_.on_scene(scene);
  auto ahead = forecast_.forecast(discs == 0 ? scene.discs.size() : discs, belief);
  if (!ahead || ahead->sigma > settings_.ahead_sigma) return std::nullopt;
  const bool nothing_to_do = smallest_gap(ahead->scene) >= min_gap && count_outside(ahead->scene.discs, region) == 0;
  next_slid_ = ahead->slid;
  if (!draft_) return nothing_to_do ? std::nullopt : std::optional{Question{std::move(ahead->scene), {}}};

  const SceneChange change = change_between(draft_->scene, ahead->scene, min_gap, position_sigma_);
  if (!change.same_discs || change.in_sigmas > kSamePlace) {
    ++counts_.renewed;
    draft_.reset();
    return nothing_to_do ? std::nullopt : std::optional{Question{std::move(ahead->scene), {}}};
  }
  // Now that they rest, what was decided while they slid can be corrected at once, and need not be when the scene has settled.
  const bool correct = draft_->slid && !ahead->slid && draft_->decision && draft_->decision->kind == strategy::Decision::Kind::kStroke;
  if (!correct) return std::nullopt;
  return Question{std::move(ahead->scene), draft_->decision->options};
}

void PlanAhead::asked(const Question& question, std::uint64_t ticket) {
  draft_ = Draft{ticket, question.scene, next_slid_, std::nullopt, draft_ ? draft_->think : Duration::zero()};
}

bool PlanAhead::take(std::uint64_t ticket, strategy::Decision& decision, Duration think) {
  if (!draft_ || draft_->ticket != ticket || draft_->decision) return false;
  draft_->decision = std::move(decision);
  draft_->think += think;
  return true;
}

PlanAhead::Verdict PlanAhead::settle(const Scene& scene, double min_gap) {
  since_.reset();
  if (!draft_) return Verdict::kNone;
  const SceneChange seen = change_between(draft_->scene, scene, min_gap, 0.0);
  const SceneChange foreseen = change_between(draft_->scene, scene, min_gap, position_sigma_);
  char text[64];
  std::snprintf(text, sizeof text, "planned ahead, discs %.2f mm off", 1e3 * seen.furthest);
  note_ = text;
  if (!draft_->slid && seen.same_order && seen.same_pairs && seen.in_sigmas <= kSamePlace) {
    ++counts_.kept;
    return Verdict::kKeep;
  }
  if (foreseen.same_discs && foreseen.in_sigmas <= kSamePlace) {
    ++counts_.corrected;
    return Verdict::kCorrect;
  }
  not_needed();
  return Verdict::kNone;
}

void PlanAhead::not_needed() {
  counts_.dropped += draft_ ? 1 : 0;
  stop();
}

strategy::Decision PlanAhead::take_decision(Duration& think) {
  think = draft_->think;
  strategy::Decision decision = std::move(*draft_->decision);
  draft_.reset();
  return decision;
}

}  // namespace breakshot::task
