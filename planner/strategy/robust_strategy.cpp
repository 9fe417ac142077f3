#include "planner/strategy/robust_strategy.hpp"

#include "common/outside.hpp"
#include "planner/strategy/revision.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace breakshot::strategy {

namespace {

/// Each round keeps one in kKeep and tries it in kKeep times as many worlds.
constexpr std::size_t kKeep = 4;
/// At least so many strokes are tried in all worlds.
constexpr std::size_t kFinalists = 16;
/// The arm is asked about the best of them until it has accepted so many.
constexpr std::size_t kAccepted = 4;
/// Rollouts of so many discs count as one each of the budget, those of more as more: what they cost grows with the discs.
constexpr double kCrowd = 8.0;

std::string text_of(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[160];
  // The formats are this file's own.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
  std::snprintf(text, sizeof text, format, a, b, c);
#pragma GCC diagnostic pop
  return text;
}

/// Whether a hit is another one, only faster.
bool is_faster(const StrokeRequest& hit, const StrokeRequest& slower) noexcept {
  return hit.kind == StrokeKind::kHit && slower.kind == StrokeKind::kHit && hit.p_WS == slower.p_WS &&
         hit.direction_W == slower.direction_W && hit.speed > slower.speed;
}

}  // namespace

Decision RobustStrategy::choose(const Scene& scene, const DecisionContext& context, std::span<const StrokeOption> earlier) {
  Decision decision;
  stop_ = context.stop;
  const auto model = model_of(scene, context.min_gap, settings_, decision.why);
  if (!model) return decision;
  outside_now_ = count_outside(model->discs, context.region);
  if (model->pairs.empty() && outside_now_ == 0) {
    decision.kind = Decision::Kind::kSingulated;
    decision.why = model->discs.size() < 2 ? "no two discs to part" : text_of("smallest gap %.1f mm", 1e3 * model->smallest_gap());
    return decision;
  }

  SampledWorlds worlds{*model, scene, context, settings_};
  std::vector<Scored> all;
  for (Candidate& candidate : stroke_candidates(*model, context, settings_)) {
    if (earlier.empty() || is_near_any(candidate.stroke, earlier)) all.push_back({std::move(candidate), {}});
  }
  const std::size_t tried = all.size();
  // The world that is believed most: what fails there need not be looked at further.
  const Scored* before = nullptr;
  for (Scored& one : all) {
    // What loses a disc at some speed loses it at more: such strokes need not be run to be left out.
    one.lost_more = before != nullptr && before->lost_more > 0 && is_faster(one.candidate.stroke, before->candidate.stroke) ? 1 : 0;
    if (one.lost_more == 0) try_in_worlds(one, worlds, 1);
    before = &one;
  }
  const double now = rest_time(model->pairs.size()) + settings_.robust.lost_price * outside_now_;
  std::erase_if(all, [&](const Scored& one) { return one.worlds == 0 || one.lost_more > 0; });
  // Where nothing improves matters (a crowd, one pair left in its middle), the stroke that spoils least is better than giving up.
  const auto improves = [&](const Scored& one) { return one.mean() - stroke_time(one) < now; };
  if (std::any_of(all.begin(), all.end(), improves)) std::erase_if(all, [&](const Scored& one) { return !improves(one); });
  const double part = earlier.empty() ? 1.0 : kRevisionPart;
  reject_successively(all, worlds, std::max(1.0, static_cast<double>(model->discs.size()) / kCrowd) / part);
  std::string refusal;
  if (context.filter != nullptr) ask_arm(all, worlds, *context.filter, refusal);
  if (stop_.stop_requested()) return {Decision::Kind::kNoStroke, {}, "given up: nobody waits for it"};

  for (const Scored& one : all) {
    if (decision.options.size() == static_cast<std::size_t>(settings_.rules.alternatives)) break;
    decision.options.push_back(option_of(one, worlds));
  }
  if (decision.options.empty()) {
    decision.why = tried == 0 ? "no stroke has room" : "each of " + std::to_string(tried) + " strokes would lose a disc or cannot be run";
    if (!refusal.empty()) decision.why += "; " + refusal;
    return decision;
  }
  decision.kind = Decision::Kind::kStroke;
  if (!refusal.empty()) decision.options.front().why += "; preferred " + refusal;
  return decision;
}

double RobustStrategy::stroke_time(const Scored& one) const noexcept {
  const auto& rules = settings_.robust;
  const StrokeRequest& stroke = one.candidate.stroke;
  if (one.forecast.total > 0.0) return one.forecast.total + rules.settle_time;
  return stroke.kind == StrokeKind::kHit ? rules.hit_time : rules.push_time + stroke.length / stroke.speed;
}

double RobustStrategy::rest_time(std::size_t pairs) const noexcept {
  return pairs == 0 ? 0.0 : settings_.robust.rest_time + settings_.robust.pair_time * static_cast<double>(pairs);
}

double RobustStrategy::cost_of(const Scored& one, const Aftermath& aftermath) const noexcept {
  const auto& rules = settings_.robust;
  return stroke_time(one) + rest_time(static_cast<std::size_t>(aftermath.pairs_below)) + rules.lost_price * aftermath.outside +
         rules.edge_price * aftermath.edge;
}

void RobustStrategy::try_in_worlds(Scored& one, SampledWorlds& worlds, std::size_t up_to) const {
  for (std::size_t world = one.worlds; world < up_to; ++world) {
    if (stop_.stop_requested()) return;
    const Aftermath aftermath = worlds.run(one.candidate.stroke, one.forecast, world);
    if (!aftermath.valid) return;
    one.cost += cost_of(one, aftermath);
    one.singulated += aftermath.pairs_below == 0 && aftermath.outside == 0 ? 1 : 0;
    one.lost += aftermath.outside > 0 ? 1 : 0;
    one.lost_more += aftermath.outside > outside_now_ ? 1 : 0;
    ++one.worlds;
  }
}

void RobustStrategy::reject_successively(std::vector<Scored>& all, SampledWorlds& worlds, double rollout_cost) const {
  const auto by_mean = [](const Scored& a, const Scored& b) { return a.mean() < b.mean(); };
  const auto most = static_cast<std::size_t>(settings_.robust.worlds);
  std::stable_sort(all.begin(), all.end(), by_mean);
  const auto rollouts = static_cast<std::size_t>(settings_.robust.rollouts / rollout_cost);
  for (std::size_t up_to = kKeep; !all.empty(); up_to *= kKeep) {
    up_to = std::min(up_to, most);
    // Rounds cost about the same: what is kept times the worlds that it is tried in.
    const std::size_t affordable = rollouts / (4 * up_to);
    const std::size_t kept = std::max(kFinalists, std::min(affordable, all.size()));
    if (all.size() > kept) all.resize(kept);
    for (Scored& one : all) try_in_worlds(one, worlds, up_to);
    // A world that could not run a stroke (the striker would come down on a disc there) speaks against it as much as a lost disc.
    for (Scored& one : all) {
      if (one.worlds < up_to) one.cost += settings_.robust.lost_price * static_cast<double>(up_to - one.worlds);
    }
    std::stable_sort(all.begin(), all.end(), by_mean);
    if (up_to == most) break;
  }
}

void RobustStrategy::ask_arm(std::vector<Scored>& all, SampledWorlds& worlds, StrokeFilter& arm, std::string& refusal) const {
  std::vector<Scored> accepted;
  for (std::size_t k = 0; k < all.size() && accepted.size() < kAccepted && !stop_.stop_requested(); ++k) {
    auto answer = arm.forecast(all[k].candidate.stroke);
    if (!answer) {
      if (refusal.empty()) refusal = all[k].candidate.what + ": " + answer.error().text;
      continue;
    }
    Scored again{std::move(all[k].candidate), *answer};
    try_in_worlds(again, worlds, static_cast<std::size_t>(settings_.robust.worlds));
    if (again.worlds > 0) accepted.push_back(std::move(again));
  }
  std::stable_sort(accepted.begin(), accepted.end(), [](const Scored& a, const Scored& b) { return a.mean() < b.mean(); });
  all = std::move(accepted);
}

StrokeOption RobustStrategy::option_of(const Scored& one, SampledWorlds& worlds) const {
  const auto believed = worlds.run(one.candidate.stroke, one.forecast, 0);
  StrokeOption option;
  option.stroke = one.candidate.stroke;
  option.predicted_gap = believed.smallest_gap;
  option.predicted_p_WD.assign(believed.p_WD.begin(), believed.p_WD.end());
  option.p_singulated = static_cast<double>(one.singulated) / static_cast<double>(one.worlds);
  option.p_lost = static_cast<double>(one.lost) / static_cast<double>(one.worlds);
  option.cost_s = one.mean();
  option.why = one.candidate.what +
               text_of(": %.1f s to finish, P(singulated) %.2f, P(lost) %.3f", option.cost_s, option.p_singulated, option.p_lost) + " in " +
               std::to_string(one.worlds) + " worlds";
  return option;
}

}  // namespace breakshot::strategy
