#include "planner/strategy/hybrid_strategy.hpp"

#include "common/outside.hpp"
#include "planner/strategy/stroke_room.hpp"
#include "planner/strategy/strokes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace breakshot::strategy {

namespace {

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", 1e3 * metres);
  return text;
}

std::string metres_per_second(double speed) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f m/s", speed);
  return text;
}

/// Notes the first obstacle met; later ones are of less preferred strokes and say less.
void note(std::string& why, const std::string& what, const std::string& why_not) {
  if (why.empty()) why = what + ": " + why_not;
}

}  // namespace

HybridStrategy::HybridStrategy(const StrategySettings& settings) : settings_{settings}, trial_{settings.cell} {}

Decision HybridStrategy::decide(const Scene& scene, const DecisionContext& context) {
  Decision decision;
  const auto model = model_of(scene, context.min_gap, settings_, decision.why);
  if (!model) return decision;
  if (const int outside = count_outside(model->discs, context.region); outside > 0) {
    // The paper knows no way back.
    decision.why = std::to_string(outside) + " of " + std::to_string(model->discs.size()) + " discs rest outside the region";
    return decision;
  }
  if (model->pairs.empty()) {
    decision.kind = Decision::Kind::kSingulated;
    decision.why = model->discs.size() < 2 ? "no two discs to part" : "smallest gap " + millimetres(model->smallest_gap());
    return decision;
  }
  add_hits(*model, context, decision);
  add_pushes(*model, context, decision);
  if (!decision.options.empty()) {
    decision.kind = Decision::Kind::kStroke;
  } else if (decision.why.empty()) {
    decision.why = "no stroke left";
  }
  return decision;
}

void HybridStrategy::add_hits(const TableModel& model, const DecisionContext& context, Decision& decision) {
  if (!hits()) return;
  const auto largest = std::max_element(model.cluster_size.begin(), model.cluster_size.end());
  if (*largest <= settings_.rules.hit_above) return;
  if (context.hits_left == 0) {
    decision.why = "no hit left";
    return;
  }
  std::string obstacle;
  // Half of the offers at most are hits: should the arm refuse them all, pushes are to be among what is left.
  const auto enough = static_cast<std::size_t>(settings_.rules.alternatives + 1) / 2;
  for (const HitAim& aim : hit_aims(model, static_cast<int>(largest - model.cluster_size.begin()), context)) {
    if (decision.options.size() >= enough) break;
    std::string why_not;
    auto option = hit_option(model, aim, context, decision.options.empty(), why_not);
    if (!option) {
      note(obstacle, aim.what, why_not);
      continue;
    }
    if (!obstacle.empty() && decision.options.empty()) option->why += "; preferred " + obstacle;
    decision.options.push_back(std::move(*option));
  }
  if (decision.options.empty()) decision.why = obstacle.empty() ? "no direction to hit in" : "no hit: " + obstacle;
}

bool HybridStrategy::hit_has_room(const TableModel& model, const HitAim& aim, double speed, std::string& why_not) const {
  const auto& rules = settings_.rules;
  const auto& cell = settings_.cell;
  // Straight at full depth on the run-in, and on its way down between the discs before that.
  const Vector2 begin = low_from(hit_stroke(aim.p_WS, aim.direction_W, speed, rules), cell);
  if (!way_is_inside(cell.striker_area, begin, aim.p_WS)) {
    why_not = "the run-in leaves the striker's area";
    return false;
  }
  if (!way_is_free(model.discs, begin, aim.p_WS, cell.striker_radius, rules.landing_margin, aim.disc)) {
    why_not = "a disc stands in the run-in";
    return false;
  }
  return true;
}

std::vector<HybridStrategy::SpeedTrial> HybridStrategy::try_speeds(const TableModel& model, const HitAim& aim,
                                                                   const DecisionContext& context, std::string& why_ended) {
  // "We repeatedly hit the formation with the chosen direction, while increasing velocity until the desired distance is obtained", or
  // as long as "the disks remain inside the predefined workspace" (paper, Sec. 4).
  const auto& rules = settings_.rules;
  const double fastest = std::min(rules.hit_speed_max * context.speed_scale, context.hit_speed_cap);
  std::vector<SpeedTrial> trials;
  why_ended = "the arm is too slow there";
  const auto steps = static_cast<int>(std::floor((fastest - rules.hit_speed_min) / rules.hit_speed_step + 1e-6));
  for (int step = 0; step <= steps; ++step) {
    const double speed = rules.hit_speed_min + step * rules.hit_speed_step;
    if (!hit_has_room(model, aim, speed, why_ended)) break;
    auto trial = trial_.run(model, hit_stroke(aim.p_WS, aim.direction_W, speed, rules), context, why_ended);
    if (!trial) break;
    if (trial->border < rules.border_margin_hit) {
      why_ended = "faster, a disc would leave";
      break;
    }
    const bool done = trial->pairs_below == 0;
    trials.push_back({speed, std::move(*trial)});
    if (done) break;
  }
  return trials;
}

std::optional<StrokeOption> HybridStrategy::hit_option(const TableModel& model, const HitAim& aim, const DecisionContext& context,
                                                       bool leads, std::string& why_not) {
  std::vector<SpeedTrial> trials = try_speeds(model, aim, context, why_not);
  // A hit that parts nothing, all told, only spends a stroke.
  const auto useless = [&](const SpeedTrial& one) { return one.result.pairs_below >= static_cast<int>(model.pairs.size()); };
  if (std::erase_if(trials, useless) > 0 && trials.empty()) why_not = "no fewer pairs below the gap at any speed in the virtual world";
  const auto refusal_at = [&](const SpeedTrial& one) -> std::optional<StrokeRefusal> {
    if (!leads || context.filter == nullptr) return std::nullopt;
    return context.filter->refusal(hit_stroke(aim.p_WS, aim.direction_W, one.speed, settings_.rules));
  };
  while (!trials.empty()) {
    // The slowest of those that leave the fewest pairs: speed beyond that only carries discs further.
    const auto best = std::min_element(
        trials.begin(), trials.end(), [](const SpeedTrial& a, const SpeedTrial& b) { return a.result.pairs_below < b.result.pairs_below; });
    const auto refusal = refusal_at(*best);
    if (!refusal) {
      StrokeOption option = option_of(hit_stroke(aim.p_WS, aim.direction_W, best->speed, settings_.rules), best->result, context);
      option.why = "hit " + aim.what + " at " + metres_per_second(best->speed) + ": ";
      option.why += best->result.pairs_below == 0
                        ? "gap " + millimetres(best->result.smallest_gap) + " in the virtual world"
                        : std::to_string(best->result.pairs_below) + " pairs left below the gap in the virtual world; " + why_not;
      return option;
    }
    why_not = refusal->text;
    if (refusal->reason != RefusalReason::kTooFast) return std::nullopt;
    // What the arm does at a speed it does at lower ones: halve the way down to the fastest that it does.
    trials.erase(best, trials.end());
    auto accepted = trials.begin();
    for (auto low = trials.begin(), high = trials.end(); low != high;) {
      const auto middle = low + (high - low) / 2;
      if (refusal_at(*middle)) {
        high = middle;
      } else {
        low = accepted = middle + 1;
      }
    }
    trials.erase(accepted, trials.end());
  }
  return std::nullopt;
}

void HybridStrategy::add_pushes(const TableModel& model, const DecisionContext& context, Decision& decision) {
  if (context.pushes_left == 0) {
    if (decision.why.empty()) decision.why = "no push left";
    return;
  }
  const auto& rules = settings_.rules;
  struct Tried {
    const PushAim* aim;
    StrokeRequest stroke;
    TrialResult trial;
    int rank;
  };
  std::string obstacle;
  std::vector<Tried> tried;
  const std::vector<PushAim> aims = push_aims(model, context);
  for (const PushAim& aim : aims) {
    std::string why_not;
    const StrokeRequest stroke = push_stroke(aim.p_WS, aim.direction_W, aim.length, rules);
    if (!way_is_inside(settings_.cell.striker_area, aim.p_WS, aim.p_WS + aim.length * aim.direction_W)) {
      note(obstacle, "push " + aim.what, "the line leaves the striker's area");
      continue;
    }
    auto trial = trial_.run(model, stroke, context, why_not);
    if (!trial) {
      note(obstacle, "push " + aim.what, why_not);
      continue;
    }
    if (trial->border < 0.0) {
      note(obstacle, "push " + aim.what, "a disc would leave the region");
      continue;
    }
    const ClosePair& pair = model.pairs[aim.pair];
    const double parted = (trial->p_WD[pair.a] - trial->p_WD[pair.b]).norm() - model.discs[pair.a].radius - model.discs[pair.b].radius;
    const bool near_border = trial->border < rules.border_margin_push;
    const bool in_vain = parted < context.min_gap;
    tried.push_back({&aim, stroke, std::move(*trial), weighs_pushes() ? (near_border ? 2 : 0) + (in_vain ? 1 : 0) : 0});
    if (!weighs_pushes() && tried.size() == static_cast<std::size_t>(rules.alternatives)) break;
  }
  std::stable_sort(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) { return a.rank < b.rank; });

  const bool first = decision.options.empty();
  for (const Tried& one : tried) {
    if (decision.options.size() >= static_cast<std::size_t>(rules.alternatives)) break;
    if (context.filter != nullptr && decision.options.empty()) {
      if (const auto refusal = context.filter->refusal(one.stroke)) {
        note(obstacle, "push " + one.aim->what, refusal->text);
        continue;
      }
    }
    StrokeOption option = option_of(one.stroke, one.trial, context);
    option.why = "push " + one.aim->what + ": gap now " + millimetres(model.pairs[one.aim->pair].gap) + ", " +
                 std::to_string(one.trial.pairs_below) + " pairs below the gap afterwards in the virtual world";
    if (one.rank >= 2) option.why += ", a disc near the border";
    if (first && decision.options.empty()) {
      if (!decision.why.empty()) option.why += "; " + decision.why;
      if (!obstacle.empty()) option.why += "; preferred " + obstacle;
    }
    decision.options.push_back(std::move(option));
  }
  if (decision.options.empty() && !obstacle.empty()) decision.why += (decision.why.empty() ? "" : "; ") + obstacle;
}

double HybridStrategy::push_length(const ClosePair& pair, const Vector2& p_WS, const Vector2& direction) const noexcept {
  return (pair.middle_W - p_WS).dot(direction) + 0.5 * pair.contour_length + 2.0 * settings_.cell.striker_radius;
}

StrokeOption HybridStrategy::option_of(const StrokeRequest& stroke, const TrialResult& trial, const DecisionContext& context) const {
  StrokeOption option;
  option.stroke = stroke;
  option.predicted_gap = trial.smallest_gap;
  option.predicted_p_WD = trial.p_WD;
  option.p_singulated = trial.pairs_below == 0 && trial.border >= 0.0 ? 1.0 : 0.0;
  option.p_lost = trial.border < 0.0 ? 1.0 : 0.0;
  // This stroke, and a push for each pair that it is expected to leave.
  const int pushes = std::min(trial.pairs_below, static_cast<int>(context.pushes_left));
  option.cost_s = settings_.rules.stroke_time * (1 + pushes);
  return option;
}

}  // namespace breakshot::strategy
