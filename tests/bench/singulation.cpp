#include "tests/bench/singulation.hpp"

#include "tests/bench/comparison.hpp"
#include "tests/bench/episode_tables.hpp"
#include "tests/bench/report.hpp"

#include <fmt/core.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <numbers>

namespace breakshot::bench {

namespace {

/// Of --physics compliant, s: singulation.md takes 0.3 to 0.4 ms for discs of this size.
constexpr double kContactTime = 3e-4;

/// What --world can set: the truth of the episodes' worlds and how far they are spread.
struct WorldKey {
  const char* name;
  const char* meaning;
  double low, high;
  std::function<void(support::InProcessSettings&, WorldSpread&, double)> set;
};

const std::vector<WorldKey>& world_keys() {
  using S = support::InProcessSettings;
  using W = WorldSpread;
  static const std::vector<WorldKey> keys{
      {"mu", "friction between disc and table", 0.01, 2.0, [](S& s, W&, double v) { s.sim.physics.friction = v; }},
      {"mu_spread", "half width, relative", 0.0, 0.9, [](S&, W& w, double v) { w.friction = v; }},
      {"mu_map", "how much it varies over the table, relative", 0.0, 0.5, [](S&, W& w, double v) { w.friction_map = v; }},
      {"e", "restitution between two discs", 0.0, 1.0, [](S& s, W&, double v) { s.sim.physics.restitution = v; }},
      {"e_spread", "half width", 0.0, 1.0, [](S&, W& w, double v) { w.restitution = v; }},
      {"striker_e", "restitution between striker and disc", 0.0, 1.0, [](S& s, W&, double v) { s.sim.physics.striker_restitution = v; }},
      {"rim_mu", "friction at the rims", 0.0, 1.0, [](S& s, W&, double v) { s.sim.physics.contact_friction = v; }},
      {"contact_ms", "contact time with --physics compliant", 0.01, 10.0,
       [](S& s, W&, double v) {
         if (s.sim.physics.contact_time > 0.0) s.sim.physics.contact_time = 1e-3 * v;
       }},
      {"orders", "in a row that find tables of the same friction and restitution, with one planner that goes on learning", 1.0, 1000.0,
       [](S&, W& w, double v) { w.orders = static_cast<int>(v); }},
      {"gap_mm", "contacts are opened by up to this", 0.0, 20.0, [](S&, W& w, double v) { w.gap_jitter = 1e-3 * v; }},
      {"speed_spread", "half width of a stroke's speed, relative", 0.0, 0.5, [](S&, W& w, double v) { w.stroke_speed = v; }},
      {"aim_deg", "half width of a stroke's direction", 0.0, 20.0, [](S&, W& w, double v) { w.aim = v * std::numbers::pi / 180.0; }},
      {"latency_ms", "of the camera", 0.0, 1000.0, [](S& s, W&, double v) { s.camera_latency = from_seconds(1e-3 * v); }},
      {"latency_spread_ms", "half width", 0.0, 1000.0, [](S&, W& w, double v) { w.latency = from_seconds(1e-3 * v); }},
      {"radius_min_mm", "of the discs of random clusters", 15.0, 60.0, [](S&, W& w, double v) { w.random.radius_min = 1e-3 * v; }},
      {"radius_max_mm", "", 15.0, 60.0, [](S&, W& w, double v) { w.random.radius_max = 1e-3 * v; }},
      {"compact", "of random clusters: 1 as dense as can be, 0 chains", 0.0, 1.0, [](S&, W& w, double v) { w.random.compact = v; }},
  };
  return keys;
}

/// @throws std::invalid_argument that names key, value and what is allowed
void set_world(const std::vector<std::string>& pairs, support::InProcessSettings& settings, WorldSpread& spread) {
  for (const std::string& pair : pairs) {
    const auto equals = pair.find('=');
    const std::string name = pair.substr(0, equals);
    const auto& keys = world_keys();
    const auto key = std::find_if(keys.begin(), keys.end(), [&](const WorldKey& k) { return k.name == name; });
    if (equals == std::string::npos || key == keys.end()) {
      std::string names;
      for (const auto& k : keys) names += std::string{names.empty() ? "" : ", "} + k.name;
      throw std::invalid_argument{fmt::format("--world: found \"{}\"; allowed KEY=VALUE with one of {}", pair, names)};
    }
    double value = std::nan("");
    std::size_t used = 0;
    try {
      value = std::stod(pair.substr(equals + 1), &used);
    } catch (const std::exception&) {
      used = 0;
    }
    if (used == 0 || used != pair.size() - equals - 1 || !(value >= key->low && value <= key->high)) {
      throw std::invalid_argument{
          fmt::format("--world {}: found \"{}\"; allowed {} to {}", name, pair.substr(equals + 1), key->low, key->high)};
    }
    key->set(settings, spread, value);
  }
}

std::string world_help() {
  std::string text = "Sets the truth that the planner is not told, KEY=VALUE, separated by commas:";
  for (const auto& key : world_keys())
    text += fmt::format(" {} ({}{}{} to {});", key.name, key.meaning, *key.meaning != '\0' ? "; " : "", key.low, key.high);
  text.back() = '.';
  return text;
}

std::vector<EpisodeRecord> play(const SingulationArguments& arguments, const support::InProcessSettings& settings,
                                const std::vector<std::string>& formations, const WorldSpread& spread) {
  std::vector<EpisodeSpec> specs;
  for (const auto& formation : formations) {
    for (int index = 0; index < arguments.n; ++index) {
      for (const auto& strategy : arguments.strategies) specs.push_back({formation, strategy, arguments.seed, index});
    }
  }
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto progress = [&](std::size_t done, const EpisodeRecord& record) {
    if (terminal || done % 30 == 0 || done == specs.size()) {
      fmt::print(stderr, "{}{}/{} episodes, last: {} {} {}{}", terminal ? "\r\033[K" : "", done, specs.size(), record.spec.formation,
                 record.spec.strategy, record.success ? "singulated" : to_string(record.result.task.failure),
                 terminal && done != specs.size() ? "" : "\n");
    }
  };
  return run_episodes(settings, specs, spread, arguments.limits, arguments.jobs, progress);
}

nlohmann::json bins_of(const Calibration& calibration) {
  nlohmann::json bins = nlohmann::json::array();
  for (const auto& bin : calibration.bins) bins.push_back({{"predicted", bin.predicted}, {"happened", bin.happened}, {"count", bin.count}});
  return bins;
}

void report_comparisons(const std::vector<std::string>& strategies, const std::map<std::string, Group>& all, nlohmann::json& metrics) {
  for (std::size_t i = 0; i < strategies.size(); ++i) {
    for (std::size_t j = 0; j < strategies.size(); ++j) {
      // Every strategy over the first one, as the paper does, and `robust` over all others.
      const bool wanted = i != j && (j == 0 || strategies[i] == "robust") && !(i == 0 && strategies[j] == "robust");
      if (!wanted) continue;
      const Comparison found = compare(all.at(strategies[i]), all.at(strategies[j]));
      const std::string name = "ratio_" + strategies[i] + "_to_" + strategies[j];
      metrics[name] = found.time.ratio;
      metrics[name + "_low"] = found.time.interval.low;
      metrics[name + "_high"] = found.time.interval.high;
      metrics["mcnemar_p_" + strategies[i] + "_" + strategies[j]] = found.p_success;
      fmt::print("{} over {}: mean time {:.2f} (95 %: {:.2f} to {:.2f}); succeeded alone {} and {} times, McNemar p = {:.2g}\n",
                 strategies[i], strategies[j], found.time.ratio, found.time.interval.low, found.time.interval.high, found.only_a,
                 found.only_b, found.p_success);
    }
  }
}

void report_foresight(const std::string& strategy, const Group& group, nlohmann::json& metrics) {
  const Foresight found = foresight_of(group);
  if (found.strokes == 0) return;
  metrics[strategy + ".brier_singulated"] = found.singulated.brier;
  metrics[strategy + ".brier_lost"] = found.lost.brier;
  metrics[strategy + ".reliability_singulated"] = bins_of(found.singulated);
  metrics[strategy + ".reliability_lost"] = bins_of(found.lost);
  fmt::print("{}: Brier score of P(singulated) {:.3f} (saying the mean: {:.3f}), of P(lost) {:.4f} ({:.4f}), {} strokes\n", strategy,
             found.singulated.brier, found.singulated.brier_base, found.lost.brier, found.lost.brier_base, found.strokes);
}

void report_ahead(const std::string& strategy, const nlohmann::json& metrics) {
  const auto count = [&](const char* name) { return metrics[strategy + name].get<unsigned>(); };
  const unsigned kept = count(".ahead_kept"), corrected = count(".ahead_corrected"), dropped = count(".ahead_dropped");
  if (kept + corrected + dropped == 0) return;
  fmt::print("{}: decisions begun before the scene had settled: {} kept, {} corrected, {} dropped; {} begun anew meanwhile\n", strategy,
             kept, corrected, dropped, count(".ahead_renewed"));
}

void report_learning(const std::string& strategy, const Group& group, nlohmann::json& metrics) {
  for (const std::size_t strokes : {1, 2, 3}) {
    const Learnt found = learnt_after(group, strokes);
    if (found.episodes == 0) continue;
    const std::string name = strategy + ".after_" + std::to_string(strokes) + "_strokes.";
    metrics[name + "friction_error_median"] = found.friction_error;
    metrics[name + "friction_error_p90"] = found.friction_error_p90;
    metrics[name + "friction_in_two_sigma"] = found.friction_in_two_sigma;
    metrics[name + "restitution_error_median"] = found.restitution_error;
    fmt::print(
        "{}: after {} stroke{} mu is off by {:.1f} % (median), {:.1f} % (p90), within 2 sigma in {:.0f} %; e by {:.1f} %; {} episodes\n",
        strategy, strokes, strokes == 1 ? "" : "s", 100.0 * found.friction_error, 100.0 * found.friction_error_p90,
        100.0 * found.friction_in_two_sigma, 100.0 * found.restitution_error, found.episodes);
  }
}

int run(const SingulationArguments& arguments) {
  auto settings = support::load_in_process_settings(arguments.config, arguments.overrides);
  WorldSpread spread = arguments.spread;
  spread.random.discs = arguments.discs;
  if (arguments.physics == "compliant") settings.sim.physics.contact_time = kContactTime;
  set_world(arguments.world, settings, spread);
  settings.sight = arguments.camera == "rendered" ? support::Sight::kRendered : support::Sight::kNoiseModel;
  if (arguments.camera == "perfect") settings.perception_errors = {.centre_sigma = 0.0, .radius_sigma = 0.0};
  auto formations = arguments.formations;
  if (formations.empty()) {
    formations = formation_names(settings.cell);
    formations.emplace_back("random");
  }
  const auto records = play(arguments, settings, formations, spread);

  print_head();
  std::map<std::string, Group> all;
  for (const auto& formation : formations) {
    for (const auto& strategy : arguments.strategies) {
      Group group;
      for (const auto& record : records) {
        if (record.spec.formation == formation && record.spec.strategy == strategy) group.push_back(&record);
      }
      print_row(formation, strategy, group);
      all[strategy].insert(all[strategy].end(), group.begin(), group.end());
    }
  }
  fmt::print("\n");
  nlohmann::json metrics;
  for (const auto& strategy : arguments.strategies) {
    if (formations.size() > 1) print_row("all", strategy, all[strategy]);
    const nlohmann::json of_strategy = metrics_of(all[strategy]);
    for (const auto& [name, value] : of_strategy.items()) metrics[strategy + "." + name] = value;
  }
  report_comparisons(arguments.strategies, all, metrics);
  for (const auto& strategy : arguments.strategies) {
    report_foresight(strategy, all[strategy], metrics);
    report_ahead(strategy, metrics);
    const TimeLeft left = time_left(all[strategy]);
    metrics[strategy + ".rest_time_s"] = left.rest_time;
    metrics[strategy + ".pair_time_s"] = left.pair_time;
    fmt::print("{}: at a decision {:.2f} s are left and {:.3f} s for each pair below G (least squares, {} decisions)\n", strategy,
               left.rest_time, left.pair_time, left.decisions);
  }
  for (const auto& strategy : settings.learn ? arguments.strategies : std::vector<std::string>{})
    report_learning(strategy, all[strategy], metrics);
  fmt::print(
      "(a failure counts as {:.0f} s; time of the cell clock, {:.0f} ms charged for each decision, {:.0f} ms for one of `robust`; {} "
      "camera, {} physics)\n",
      kFailureTime, 1e3 * to_seconds(settings.think_charge), 1e3 * to_seconds(settings.robust_think_charge), arguments.camera,
      arguments.physics);

  const nlohmann::json args{{"n", arguments.n},
                            {"seed", arguments.seed},
                            {"strategies", arguments.strategies},
                            {"formations", formations},
                            {"discs", arguments.discs},
                            {"world", arguments.world},
                            {"camera", arguments.camera},
                            {"physics", arguments.physics},
                            {"set", arguments.overrides},
                            {"max_hits", arguments.limits.hits},
                            {"max_pushes", arguments.limits.pushes}};
  if (!arguments.json_file.empty()) write_file(arguments.json_file, report(arguments.bench, args, metrics).dump(2) + "\n");
  if (!arguments.csv_file.empty()) write_file(arguments.csv_file, episodes_csv(records));
  if (!arguments.strokes_file.empty()) write_file(arguments.strokes_file, strokes_csv(records));
  if (!arguments.tables_file.empty()) write_file(arguments.tables_file, episode_tables(records, settings.cell).dump() + "\n");
  return 0;
}

}  // namespace

int run_singulation(SingulationArguments arguments, const std::string& what, int argc, char** argv) {
  CLI::App app{what, "bench " + arguments.bench};
  app.add_option("--config", arguments.config, "The cell's configuration file")->capture_default_str();
  app.add_option("--set", arguments.overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);
  app.add_option("--n", arguments.n, "Episodes per formation and strategy")->check(CLI::Range(1, 10000))->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same episodes, bit by bit")->capture_default_str();
  app.add_option("--strategy", arguments.strategies, "Strategies, separated by commas")->delimiter(',')->capture_default_str();
  app.add_option("--formation", arguments.formations, "Formations, separated by commas; \"random\" for random clusters; default: all")
      ->delimiter(',');
  app.add_option("--discs", arguments.discs, "Discs of a random cluster")->check(CLI::Range(2, 50))->capture_default_str();
  app.add_option("--world", arguments.world, world_help())->delimiter(',');
  app.add_option("--physics", arguments.physics, "ode: impacts are instants; compliant: springs with dampers")
      ->check(CLI::IsMember({"ode", "compliant"}))
      ->capture_default_str();
  app.add_option("--camera", arguments.camera,
                 "rendered; noise-model: scenes drawn from the truth by perception's measured errors; perfect: the truth itself, "
                 "to see what errors of perception cost")
      ->check(CLI::IsMember({"rendered", "noise-model", "perfect"}))
      ->capture_default_str();
  app.add_option("--max-hits", arguments.limits.hits, "Hits that an order allows; 0: pushes only")->capture_default_str();
  app.add_option("--max-pushes", arguments.limits.pushes, "Pushes that an order allows; 0: hits only")->capture_default_str();
  app.add_option("--jobs", arguments.jobs, "Threads, each with a cell of its own")->check(CLI::Range(1, 64))->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  app.add_option("--csv", arguments.csv_file, "Write every episode to this file");
  app.add_option("--strokes-csv", arguments.strokes_file, "Write every stroke to this file: predicted and achieved, and what it taught");
  app.add_option("--tables", arguments.tables_file, "Write where the discs stood before each stroke and at the end to this file (JSON)");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench " << arguments.bench << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace breakshot::bench
