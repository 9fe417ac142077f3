// `./breakshot bench strokes`: how exact strokes are, as planned and as the simulated arm runs them, and how far from the least time that any plan could take.

#include "tests/bench/report.hpp"
#include "tests/bench/statistics.hpp"
#include "tests/bench/stroke_map.hpp"
#include "tests/bench/stroke_trials.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <iostream>
#include <map>
#include <numbers>

namespace breakshot::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Arguments {
  std::string config = "config/cell.yaml";
  std::vector<std::string> overrides;
  int n = 200;
  int mixed = 0;
  std::uint64_t seed = 1;
  int threads = 1;
  bool planned_only = false;
  std::vector<double> speeds{0.3, 0.6, 1.0, 1.5};
  std::string json_file;
  std::string paths_file;
};

double largest(const std::vector<double>& values) { return quantile(values, 1.0); }

/// Errors of strokes in the units of the goals.
struct Errors {
  std::vector<double> position, direction, speed, height, deviation;  ///< mm, deg, %, mm, mm

  template <typename Found>
  void add(const Found& found) {
    position.push_back(1e3 * found.position_error);
    direction.push_back(found.direction_error / kDegree);
    speed.push_back(100.0 * found.speed_error);
  }
};

/// All rows of the table together.
struct Totals {
  Errors hits_planned, hits_alone, hits_touch, pushes_planned, pushes_alone, pushes_with_discs;
  std::vector<double> late_us, measured_speed_pct;  ///< of first touches; of StrokeStatus::contact_speed beside the truth
  std::vector<double> over_bound, push_over_bound;
  std::vector<double> over_separate;  ///< of strokes that took over from another one
  int following = 0;                  ///< strokes that had one to take over from
  std::vector<double> margin;         ///< StrokeTimes::singularity_margin, m/rad
  double tracking_urad = 0.0, torque_share = 0.0;
  int violations = 0, second_contacts = 0, stopped = 0, untouched = 0, unmeasured = 0, struck_twice = 0, strokes = 0, accepted = 0;

  void add(const Trial& trial) {
    ++strokes;
    if (trial.refusal) return;
    ++accepted;
    const bool hit = trial.request.kind == StrokeKind::kHit;
    if (!trial.broken.empty()) ++violations;
    if (trial.meets_disc_twice()) ++second_contacts;
    if (trial.over_bound > 0.0) over_bound.push_back(trial.over_bound);
    if (trial.follows) ++following;
    if (trial.over_separate > 0.0) over_separate.push_back(trial.over_separate);
    if (trial.push && trial.push->least > 0.0) push_over_bound.push_back(trial.push->planned / trial.push->least);
    if (trial.request.kind == StrokeKind::kPark) return;
    margin.push_back(trial.times.singularity_margin);
    Errors& planned = hit ? hits_planned : pushes_planned;
    planned.add(trial.planned);
    planned.deviation.push_back(1e3 * trial.planned.line_deviation);
    if (trial.alone) add_achieved(trial);
  }

 private:
  void add_achieved(const Trial& trial) {
    const bool hit = trial.request.kind == StrokeKind::kHit;
    for (const auto* run : {&*trial.alone, &*trial.with_discs}) {
      if (!run->stopped.empty()) ++stopped;
      if (run == &*trial.alone) tracking_urad = std::max(tracking_urad, 1e6 * run->tracking_error);
      torque_share = std::max(torque_share, run->peak_torque_share);
      Errors& achieved = hit ? hits_alone : run == &*trial.alone ? pushes_alone : pushes_with_discs;
      if (hit && run != &*trial.alone) continue;  // past the touch
      achieved.add(*run);
      achieved.height.push_back(1e3 * run->height_error);
      achieved.deviation.push_back(1e3 * run->line_deviation);
    }
    if (!hit) return;
    if (trial.with_discs->strikes > 1) ++struck_twice;
    const auto& touch = trial.with_discs->touch;
    if (!touch) {
      ++untouched;
      return;
    }
    hits_touch.add(*touch);
    late_us.push_back(1e6 * std::abs(touch->late));
    if (const auto measured = trial.with_discs->measured_speed) {
      measured_speed_pct.push_back(100.0 * std::abs(*measured / touch->speed - 1.0));
    } else {
      ++unmeasured;
    }
  }
};

/// A row of the table.
void put_row(const std::string& name, const std::vector<Trial>& trials, nlohmann::json& metrics) {
  int possible = 0;
  int accepted = 0;
  double attainable = 0.0;  // the most that a refusal as too fast says, m/s
  std::map<std::string, int> refusals;
  std::vector<double> total, to_contact, low_after, plan_ms, over_bound;
  for (const Trial& trial : trials) {
    if (trial.request.speed <= trial.speed_bound) ++possible;
    plan_ms.push_back(trial.plan_ms);
    if (trial.refusal) {
      ++refusals[to_string(trial.refusal->reason)];
      attainable = std::max(attainable, trial.refusal->attainable);
      continue;
    }
    ++accepted;
    total.push_back(to_seconds(trial.times.total));
    to_contact.push_back(to_seconds(trial.times.contact));
    low_after.push_back(1e3 * trial.times.low_after);
    if (trial.over_bound > 0.0) over_bound.push_back(trial.over_bound);
  }
  const double accepted_pct = 100.0 * accepted / static_cast<double>(trials.size());
  const double of_possible_pct = 100.0 * accepted / std::max(1, possible);
  fmt::print("{:<14}{:>9.1f} %{:>9.1f} %{:>9.2f}{:>9.2f}{:>8.2f}{:>9.1f}{:>9.2f}{:>9.2f}\n", name, accepted_pct, of_possible_pct,
             mean(total), mean(to_contact), mean(over_bound), mean(low_after), mean(plan_ms), quantile(plan_ms, 0.99));
  for (const auto& [reason, count] : refusals) fmt::print("{:<14}  refused, {}: {}\n", "", reason, count);
  if (attainable > 0.0) fmt::print("{:<14}  attainable where too fast, at most {:.3f} m/s\n", "", attainable);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const StrokeRequest& r = trials[i].request;
    if (trials[i].broken.empty() && !trials[i].meets_disc_twice()) continue;
    fmt::print("{:<14}  stroke {}, {} at ({:.4f}, {:.4f}) m along ({:.4f}, {:.4f}), {:.3f} m/s, low for {:.0f} mm: {}{}\n", "", i,
               to_string(r.kind), r.p_WS.x(), r.p_WS.y(), r.direction_W.x(), r.direction_W.y(), r.speed, 1e3 * trials[i].times.low_after,
               trials[i].broken, trials[i].meets_disc_twice() ? "meets its disc twice" : "");
  }
  metrics[name + ".accepted_pct"] = accepted_pct;
  metrics[name + ".accepted_of_possible_pct"] = of_possible_pct;
  metrics[name + ".possible_pct"] = 100.0 * possible / static_cast<double>(trials.size());
  metrics[name + ".attainable_mps_max"] = attainable;
  metrics[name + ".total_s_mean"] = mean(total);
  metrics[name + ".contact_s_mean"] = mean(to_contact);
  metrics[name + ".over_bound_mean"] = mean(over_bound);
  metrics[name + ".plan_ms_mean"] = mean(plan_ms);
}

nlohmann::json paths_of(const std::vector<Trial>& pushes, const TrialSetup& setup) {
  nlohmann::json paths = nlohmann::json::array();
  for (const Trial& trial : pushes) {
    if (!trial.push || !(trial.push->least > 0.0)) continue;
    nlohmann::json q = nlohmann::json::array();
    for (const JointVector& sample : trial.push->path.q) q.push_back(std::vector<double>(sample.begin(), sample.end()));
    std::vector<double> max_speed;
    for (const JointDescription& joint : setup.rig.arm.joints) max_speed.push_back(joint.max_speed);
    paths.push_back({{"step", trial.push->path.step},
                     {"speed", trial.request.speed},
                     {"max_speed", max_speed},
                     {"max_acceleration", setup.motion.max_acceleration},
                     {"q", q},
                     {"planned_s", trial.push->planned},
                     {"bound_s", trial.push->least}});
  }
  return paths;
}

/// A stroke of any kind, speed and place that the controller may be asked for.
StrokeRequest any_stroke(SplitMix64& random, const TrialSetup& setup) {
  const double kind = random.uniform();
  if (kind < 0.1) return {};  // a park
  if (kind < 0.4) return support::random_push(random, setup.motion.striker_area);
  StrokeRequest hit = support::random_hit(random, setup.motion.striker_area, random.uniform(0.05, 1.5));
  hit.run_in = random.uniform(0.0, 0.1);
  return hit;
}

int run(const Arguments& arguments) {
  const TrialSetup setup = load_trial_setup(arguments.config, arguments.overrides);
  const TrialScope scope{true, !arguments.planned_only};
  nlohmann::json metrics;
  Totals all;
  StrokeMap map{setup.cell.workspace};
  fmt::print("{:<14}{:>11}{:>11}{:>9}{:>9}{:>8}{:>9}{:>9}{:>9}\n", "stroke", "accepted", "possible", "total s", "contact", "/bound",
             "past mm", "plan ms", "p99 ms");
  const auto trials_of = [&](const std::string& name, int n, TrialScope how, const RequestSource& source) {
    auto trials = run_trials(setup, source, n, arguments.seed, how, arguments.threads);
    put_row(name, trials, metrics);
    for (const Trial& trial : trials) all.add(trial);
    return trials;
  };
  for (const double speed : arguments.speeds) {
    const std::string name = fmt::format("hit_{:.1f}", speed);
    const auto trials =
        trials_of(name, arguments.n, scope, [&](SplitMix64& random) { return support::random_hit(random, setup.cell.workspace, speed); });
    map.add(name, trials);
  }
  const auto pushes =
      trials_of("push", arguments.n, scope, [&](SplitMix64& random) { return support::random_push(random, setup.cell.workspace); });
  map.add("push", pushes);
  if (arguments.mixed > 0)
    trials_of("mixed", arguments.mixed, {false, false}, [&](SplitMix64& random) { return any_stroke(random, setup); });

  metrics["planned_hit_position_err_mm_p99"] = quantile(all.hits_planned.position, 0.99);
  metrics["planned_hit_direction_err_deg_p99"] = quantile(all.hits_planned.direction, 0.99);
  metrics["planned_hit_speed_err_pct_p99"] = quantile(all.hits_planned.speed, 0.99);
  metrics["planned_run_in_deviation_mm_max"] = largest(all.hits_planned.deviation);
  metrics["planned_push_deviation_mm_max"] = largest(all.pushes_planned.deviation);
  metrics["planned_push_speed_err_pct_max"] = largest(all.pushes_planned.speed);
  metrics["push_over_toppra_median"] = quantile(all.push_over_bound, 0.5);
  metrics["push_over_toppra_p90"] = quantile(all.push_over_bound, 0.9);
  metrics["transit_over_bound_mean"] = mean(all.over_bound);
  metrics["limit_violations"] = all.violations;
  metrics["second_contacts"] = all.second_contacts;
  metrics["strokes"] = all.strokes;
  metrics["strokes_accepted"] = all.accepted;

  nlohmann::json goals;
  fmt::print("\n");
  const auto goal = [&](const char* name, double bound) {
    const double value = metrics[name].get<double>();
    goals[name] = {{"value", value}, {"goal", bound}, {"met", value <= bound}};
    fmt::print("{:<36}{:>10.4g}   goal at most {:<8.4g}{}\n", name, value, bound, value <= bound ? "" : "   missed");
  };
  const auto tell = [&](const char* name, double value) {
    metrics[name] = value;
    fmt::print("{:<36}{:>10.4g}\n", name, value);
  };
  if (!arguments.planned_only) {
    // The worse of: on an empty table at the tick of the contact; at the first touch of a disc.
    const auto worse = [](const std::vector<double>& a, const std::vector<double>& b, double q) {
      return std::max(quantile(a, q), quantile(b, q));
    };
    metrics["hit_position_err_mm_p99"] = worse(all.hits_alone.position, all.hits_touch.position, 0.99);
    metrics["hit_direction_err_deg_p99"] = worse(all.hits_alone.direction, all.hits_touch.direction, 0.99);
    metrics["hit_speed_err_pct_p99"] = worse(all.hits_alone.speed, all.hits_touch.speed, 0.99);
    metrics["push_deviation_mm_max"] = worse(all.pushes_alone.deviation, all.pushes_with_discs.deviation, 1.0);
    metrics["push_speed_err_pct_max"] = largest(all.pushes_alone.speed);
    goal("hit_position_err_mm_p99", 0.3);
    goal("hit_direction_err_deg_p99", 0.3);
    goal("hit_speed_err_pct_p99", 1.0);
    goal("push_deviation_mm_max", 0.2);
    goal("push_speed_err_pct_max", 1.0);
    tell("hit_empty_table_position_err_mm_max", largest(all.hits_alone.position));
    tell("hit_touch_position_err_mm_max", largest(all.hits_touch.position));
    tell("hit_empty_table_speed_err_pct_max", largest(all.hits_alone.speed));
    tell("hit_touch_speed_err_pct_max", largest(all.hits_touch.speed));
    tell("hit_empty_table_direction_err_deg_max", largest(all.hits_alone.direction));
    tell("hit_touch_direction_err_deg_max", largest(all.hits_touch.direction));
    tell("hit_touch_off_tick_us_p99", quantile(all.late_us, 0.99));
    tell("hit_height_err_mm_max", largest(all.hits_alone.height));
    tell("contact_speed_err_pct_p99", quantile(all.measured_speed_pct, 0.99));
    tell("contact_speed_err_pct_max", largest(all.measured_speed_pct));
    tell("strokes_stopped", all.stopped);
    tell("hits_untouched", all.untouched);
    tell("hits_unmeasured", all.unmeasured);
    tell("hits_struck_twice", all.struck_twice);
    tell("push_empty_table_deviation_mm_max", largest(all.pushes_alone.deviation));
    tell("push_pair_deviation_mm_max", largest(all.pushes_with_discs.deviation));
    tell("push_pair_speed_err_pct_max", largest(all.pushes_with_discs.speed));
    tell("tracking_err_urad_max", all.tracking_urad);
    tell("torque_share_max", all.torque_share);
  }
  for (const char* name : {"planned_hit_position_err_mm_p99", "planned_hit_direction_err_deg_p99", "planned_hit_speed_err_pct_p99",
                           "planned_push_deviation_mm_max"}) {
    tell(name, metrics[name].get<double>());
  }
  tell("continuous_over_separate_mean", mean(all.over_separate));
  tell("continuous_over_separate_max", largest(all.over_separate));
  tell("continuous_pct", 100.0 * static_cast<double>(all.over_separate.size()) / std::max(1, all.following));
  tell("singularity_margin_m_per_rad_min", quantile(all.margin, 0.0));
  tell("singularity_margin_m_per_rad_median", quantile(all.margin, 0.5));
  goal("push_over_toppra_median", 1.10);
  goal("transit_over_bound_mean", 1.25);
  goal("limit_violations", 0.0);
  goal("second_contacts", 0.0);
  fmt::print("({} strokes of each kind, {} in all, {} accepted and measured on and between the ticks; each from where the last one ended\n",
             arguments.n, all.strokes, all.accepted);
  fmt::print(" possible: accepted of those that the joints' speeds and accelerations at the contact allow; past: low after the contact\n");
  fmt::print(" /bound: the ways to and from the contact over their joint-space bound; ms: CPU time of a plan or a refusal)\n");
  if (!arguments.planned_only) map.print();

  const nlohmann::json args{{"n", arguments.n}, {"mixed", arguments.mixed}, {"seed", arguments.seed}, {"speeds", arguments.speeds}};
  nlohmann::json written = report("strokes", args, metrics, goals);
  written["map"] = map.json();
  if (!arguments.json_file.empty()) write_file(arguments.json_file, written.dump(2) + "\n");
  if (!arguments.paths_file.empty()) write_file(arguments.paths_file, paths_of(pushes, setup).dump() + "\n");
  return 0;
}

}  // namespace
}  // namespace breakshot::bench

int main(int argc, char** argv) {
  breakshot::bench::Arguments arguments;
  CLI::App app{
      "Plans random hits and pushes of the cell's arm, runs them in the simulator and measures both: accuracy, limits, time beside lower "
      "bounds.",
      "bench strokes"};
  app.add_option("--config", arguments.config, "The cell's configuration file")->capture_default_str();
  app.add_option("--set", arguments.overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);
  app.add_option("--n", arguments.n, "Strokes of each kind")->check(CLI::Range(1, 1'000'000))->capture_default_str();
  app.add_option("--mixed", arguments.mixed, "So many more of any kind, speed and place, planned only, for their limits")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same strokes, on however many threads")->capture_default_str();
  app.add_option("--threads", arguments.threads, "Threads that plan and run strokes")->check(CLI::Range(1, 256))->capture_default_str();
  app.add_flag("--planned-only", arguments.planned_only, "Measure set-points alone; run nothing in the simulator");
  app.add_option("--speed", arguments.speeds, "Speeds of the hits, m/s, separated by commas")->delimiter(',')->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  app.add_option("--paths", arguments.paths_file, "Write the pushes' paths to this file, for tests/bench/toppra_check.py");
  CLI11_PARSE(app, argc, argv);
  try {
    return breakshot::bench::run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench strokes: " << error.what() << '\n';
    return 1;
  }
}
