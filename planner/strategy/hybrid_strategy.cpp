#include "planner/strategy/hybrid_strategy.hpp"

#include "planner/strategy/stroke_room.hpp"

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
    auto option = hit_option(model, aim, context, why_not);
    if (!option) {
      note(obstacle, aim.what, why_not);
      continue;
    }
    if (!obstacle.empty() && decision.options.empty()) option->why += "; preferred " + obstacle;
    decision.options.push_back(std::move(*option));
  }
  if (decision.options.empty()) decision.why = obstacle.empty() ? "no direction to hit in" : "no hit: " + obstacle;
}

bool HybridStrategy::hit_has_room(const TableModel& model, const HitAim& aim, std::string& why_not) const {
  const auto& rules = settings_.rules;
  const auto& cell = settings_.cell;
  const Vector2 begin = aim.p_WS - (rules.hit_run_in + rules.hit_descent) * aim.direction_W;
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

std::optional<StrokeOption> HybridStrategy::hit_option(const TableModel& model, const HitAim& aim, const DecisionContext& context,
                                                       std::string& why_not) {
  if (!hit_has_room(model, aim, why_not)) return std::nullopt;
  const auto& rules = settings_.rules;
  StrokeRequest stroke;
  stroke.kind = StrokeKind::kHit;
  stroke.p_WS = aim.p_WS;
  stroke.direction_W = aim.direction_W;
  stroke.run_in = rules.hit_run_in;

  // The speed is raised step by step until the gap is reached or a disc would leave (paper, Sec. 4).
  const double fastest = std::min(rules.hit_speed_max * context.speed_scale, context.hit_speed_cap);
  std::optional<TrialResult> best;
  double best_speed = 0.0;
  bool leaves = false;
  for (double speed = rules.hit_speed_min; speed <= fastest + 1e-9; speed += rules.hit_speed_step) {
    stroke.speed = speed;
    auto trial = trial_.run(model, stroke, context, why_not);
    if (!trial) return std::nullopt;
    if (trial->border < rules.border_margin_hit) {
      leaves = true;
      break;
    }
    if (!best || trial->pairs_below < best->pairs_below) {
      best = std::move(trial);
      best_speed = speed;
    }
    if (best->pairs_below == 0) break;
  }
  if (!best) {
    why_not = leaves ? "a disc would leave at the lowest speed" : "the arm is too slow there";
    return std::nullopt;
  }
  stroke.speed = best_speed;
  if (!allowed(stroke, context, why_not)) return std::nullopt;
  StrokeOption option = option_of(stroke, *best, context);
  option.why = "hit " + aim.what + " at " + metres_per_second(best_speed) + ": ";
  option.why += best->pairs_below == 0 ? "gap " + millimetres(best->smallest_gap) + " in the virtual world"
                                       : std::to_string(best->pairs_below) + " pairs left below the gap in the virtual world" +
                                             (leaves ? ", faster a disc would leave" : "");
  return option;
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
    StrokeRequest stroke;
    stroke.kind = StrokeKind::kPush;
    stroke.p_WS = aim.p_WS;
    stroke.direction_W = aim.direction_W;
    stroke.speed = rules.push_speed;
    stroke.length = aim.length;
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
    std::string why_not;
    if (!allowed(one.stroke, context, why_not)) {
      note(obstacle, "push " + one.aim->what, why_not);
      continue;
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

bool HybridStrategy::allowed(const StrokeRequest& stroke, const DecisionContext& context, std::string& why_not) const {
  if (context.filter == nullptr) return true;
  auto refusal = context.filter->refusal(stroke);
  if (!refusal) return true;
  why_not = std::move(*refusal);
  return false;
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
