#include "tests/bench/comparison.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace breakshot::bench {

namespace {

template <typename F>
std::vector<double> values(const Group& group, F&& f) {
  std::vector<double> all;
  for (const auto* record : group) all.push_back(static_cast<double>(f(*record)));
  return all;
}

/// Calls `f` with the plan and the outcome of every stroke that ran, and the gap that the episode's order asked for.
template <typename F>
void for_each_stroke(const EpisodeRecord& record, F&& f) {
  const auto& plans = record.result.plans;
  for (const Outcome& outcome : record.result.outcomes) {
    const auto plan = std::find_if(plans.begin(), plans.end(), [&](const Plan& p) { return p.seq == outcome.plan_seq; });
    if (plan != plans.end()) f(*plan, outcome);
  }
}

bool singulated_by(const Outcome& outcome, double min_gap) noexcept { return outcome.achieved_gap >= min_gap && outcome.discs_lost == 0; }

}  // namespace

nlohmann::json metrics_of(const Group& group) {
  std::size_t successes = 0;
  double lost = 0.0;
  double discs = 0.0;
  std::vector<double> decisions, decisions_cpu, revisions_cpu;
  task::AheadCounts ahead;
  for (const auto* record : group) {
    successes += record->success ? 1 : 0;
    lost += record->result.truly_lost;
    discs += static_cast<double>(record->result.truth.size());
    decisions.insert(decisions.end(), record->result.decision_s.begin(), record->result.decision_s.end());
    decisions_cpu.insert(decisions_cpu.end(), record->result.decision_cpu_s.begin(), record->result.decision_cpu_s.end());
    revisions_cpu.insert(revisions_cpu.end(), record->result.revision_cpu_s.begin(), record->result.revision_cpu_s.end());
    ahead += record->result.ahead;
  }
  const auto times = values(group, [](const auto& r) { return r.time_s; });
  const auto task = [&](auto&& f) { return mean(values(group, [&](const auto& r) { return f(r.result.task); })); };
  nlohmann::json metrics{
      {"ahead_kept", ahead.kept}, {"ahead_corrected", ahead.corrected}, {"ahead_dropped", ahead.dropped}, {"ahead_renewed", ahead.renewed}};
  if (!revisions_cpu.empty()) metrics["revision_cpu_p99_ms"] = 1e3 * quantile(revisions_cpu, 0.99);
  metrics.update({{"success", static_cast<double>(successes) / static_cast<double>(group.size())},
                  {"success_wilson_low", wilson(successes, group.size()).low},
                  {"lost_frac", lost / discs},
                  {"mean_time_s", mean(times)},
                  {"median_time_s", quantile(times, 0.5)},
                  {"strokes_mean", task([](const TaskStatus& t) { return t.hits + t.pushes; })},
                  {"hits_mean", task([](const TaskStatus& t) { return t.hits; })},
                  {"pushes_mean", task([](const TaskStatus& t) { return t.pushes; })},
                  {"look_s", task([](const TaskStatus& t) { return to_seconds(t.times.look); })},
                  {"think_s", task([](const TaskStatus& t) { return to_seconds(t.times.decide); })},
                  {"move_s", task([](const TaskStatus& t) { return to_seconds(t.times.move); })},
                  {"settle_s", task([](const TaskStatus& t) { return to_seconds(t.times.settle); })},
                  {"decision_p99_ms", 1e3 * quantile(decisions, 0.99)},
                  {"decision_cpu_p50_ms", 1e3 * quantile(decisions_cpu, 0.5)},
                  {"decision_cpu_p99_ms", 1e3 * quantile(decisions_cpu, 0.99)}});
  return metrics;
}

Comparison compare(const Group& a, const Group& b) {
  Comparison result;
  const auto time = [](const EpisodeRecord& r) { return r.time_s; };
  result.time = paired_ratio(values(a, time), values(b, time));
  for (std::size_t i = 0; i < a.size(); ++i) {
    result.only_a += a[i]->success && !b[i]->success ? 1 : 0;
    result.only_b += b[i]->success && !a[i]->success ? 1 : 0;
  }
  result.p_success = mcnemar(result.only_a, result.only_b);
  return result;
}

Foresight foresight_of(const Group& group) {
  std::vector<double> p_singulated, p_lost;
  std::vector<bool> singulated, lost;
  for (const auto* record : group) {
    for_each_stroke(*record, [&](const Plan& plan, const Outcome& outcome) {
      if (plan.candidates.empty()) return;
      p_singulated.push_back(plan.candidates.front().p_singulated);
      singulated.push_back(singulated_by(outcome, record->min_gap));
      p_lost.push_back(plan.candidates.front().p_lost);
      lost.push_back(outcome.discs_lost > 0);
    });
  }
  return {calibration(p_singulated, singulated), calibration(p_lost, lost), p_singulated.size()};
}

Learnt learnt_after(const Group& group, std::size_t strokes) {
  std::vector<double> friction, restitution;
  std::size_t within = 0;
  for (const auto* record : group) {
    const auto& beliefs = record->result.beliefs;
    if (beliefs.size() < strokes) continue;
    const auto& belief = beliefs[strokes - 1];
    friction.push_back(std::abs(belief.friction.mean - record->friction) / record->friction);
    restitution.push_back(std::abs(belief.restitution.mean - record->restitution) / record->restitution);
    within += std::abs(belief.friction.mean - record->friction) <= 2.0 * belief.friction.sigma ? 1 : 0;
  }
  if (friction.empty()) return {};
  return {friction.size(), quantile(friction, 0.5), quantile(restitution, 0.5), quantile(friction, 0.9),
          static_cast<double>(within) / static_cast<double>(friction.size())};
}

TimeLeft time_left(const Group& group) {
  std::vector<double> pairs, left;
  for (const auto* record : group) {
    if (!record->success) continue;
    for (const auto& decision : record->result.decisions) {
      if (decision.pairs == 0) continue;
      pairs.push_back(static_cast<double>(decision.pairs));
      left.push_back(to_seconds(decision.left));
    }
  }
  if (pairs.empty()) return {};
  const double mean_pairs = mean(pairs), mean_left = mean(left);
  double covariance = 0.0, variance = 0.0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    covariance += (pairs[k] - mean_pairs) * (left[k] - mean_left);
    variance += (pairs[k] - mean_pairs) * (pairs[k] - mean_pairs);
  }
  const double slope = variance > 0.0 ? covariance / variance : 0.0;
  return {pairs.size(), mean_left - slope * mean_pairs, slope};
}

void print_head() {
  fmt::print("{:<10}{:<15}{:>4}{:>11}{:>11}{:>11}{:>9}{:>9}{:>8}{:>8}{:>8}\n", "formation", "strategy", "n", "success", "Wilson >=", "lost",
             "mean s", "median s", "strokes", "hits", "pushes");
}

void print_row(const std::string& formation, const std::string& strategy, const Group& group) {
  const auto m = metrics_of(group);
  fmt::print("{:<10}{:<15}{:>4}{:>9.1f} %{:>9.1f} %{:>9.2f} %{:>9.2f}{:>9.2f}{:>8.2f}{:>8.2f}{:>8.2f}\n", formation, strategy, group.size(),
             100 * m["success"].get<double>(), 100 * m["success_wilson_low"].get<double>(), 100 * m["lost_frac"].get<double>(),
             m["mean_time_s"].get<double>(), m["median_time_s"].get<double>(), m["strokes_mean"].get<double>(),
             m["hits_mean"].get<double>(), m["pushes_mean"].get<double>());
}

std::string episodes_csv(const std::vector<EpisodeRecord>& records) {
  std::string out =
      "formation,index,seed,strategy,success,task,failure,time_s,cell_s,hits,pushes,discs,truly_lost,true_gap_mm,seen_gap_mm,look_s,decide_"
      "s,move_s,settle_s\n";
  for (const auto& r : records) {
    const auto& t = r.result.task;
    out += fmt::format("{},{},{},{},{},{},{},{:.3f},{:.3f},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", r.spec.formation,
                       r.spec.index, r.spec.seed, r.spec.strategy, r.success ? 1 : 0, to_string(t.phase), to_string(t.failure), r.time_s,
                       to_seconds(r.result.duration), t.hits, t.pushes, r.result.truth.size(), r.result.truly_lost, r.result.true_gap * 1e3,
                       t.smallest_gap * 1e3, to_seconds(t.times.look), to_seconds(t.times.decide), to_seconds(t.times.move),
                       to_seconds(t.times.settle));
  }
  return out;
}

std::string strokes_csv(const std::vector<EpisodeRecord>& records) {
  std::string out =
      "formation,index,seed,strategy,stroke,kind,speed,p_singulated,p_lost,cost_s,predicted_gap_mm,achieved_gap_mm,singulated,lost,contact_"
      "speed,mu,mu_learnt,mu_sigma,e,e_learnt,e_sigma\n";
  for (const auto& r : records) {
    int number = 0;
    for_each_stroke(r, [&](const Plan& plan, const Outcome& outcome) {
      const Candidate chosen = plan.candidates.empty() ? Candidate{} : plan.candidates.front();
      const strategy::TableBelief& learnt = r.result.beliefs[static_cast<std::size_t>(&outcome - r.result.outcomes.data())];
      out += fmt::format(
          "{},{},{},{},{},{},{:.3f},{:.4f},{:.4f},{:.3f},{:.3f},{:.3f},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n",
          r.spec.formation, r.spec.index, r.spec.seed, r.spec.strategy, ++number, to_string(plan.stroke.kind), plan.stroke.speed,
          chosen.p_singulated, chosen.p_lost, chosen.cost_s, 1e3 * plan.predicted_gap, 1e3 * outcome.achieved_gap,
          singulated_by(outcome, r.min_gap) ? 1 : 0, outcome.discs_lost, outcome.contact_speed, r.friction, learnt.friction.mean,
          learnt.friction.sigma, r.restitution, learnt.restitution.mean, learnt.restitution.sigma);
    });
  }
  return out;
}

}  // namespace breakshot::bench
