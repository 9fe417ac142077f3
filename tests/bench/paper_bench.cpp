// `./breakshot bench paper`: the paper's strategy beside its two baselines, on the nine formations and on random clusters, in the in-process cell.

#include "tests/bench/episodes.hpp"
#include "tests/bench/report.hpp"
#include "tests/bench/statistics.hpp"

#include <fmt/core.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <iostream>
#include <map>
#include <set>

namespace breakshot::bench {

namespace {

struct Arguments {
  std::string config = "config/cell.yaml";
  std::vector<std::string> overrides;
  int n = 10;
  std::uint64_t seed = 1;
  std::vector<std::string> strategies{"paper", "random_hybrid", "random_push"};
  std::vector<std::string> formations;
  int discs = 6;
  int jobs = 2;
  std::string json_file;
  std::string csv_file;
};

using Group = std::vector<const EpisodeRecord*>;

template <typename F>
std::vector<double> values(const Group& group, F&& f) {
  std::vector<double> all;
  for (const auto* record : group) all.push_back(static_cast<double>(f(*record)));
  return all;
}

nlohmann::json metrics_of(const Group& group) {
  std::size_t successes = 0;
  double lost = 0.0;
  double discs = 0.0;
  std::vector<double> decisions;
  for (const auto* record : group) {
    successes += record->success ? 1 : 0;
    lost += record->result.truly_lost;
    discs += static_cast<double>(record->result.truth.size());
    decisions.insert(decisions.end(), record->result.decision_s.begin(), record->result.decision_s.end());
  }
  const auto times = values(group, [](const auto& r) { return r.time_s; });
  const auto task = [&](auto&& f) { return mean(values(group, [&](const auto& r) { return f(r.result.task); })); };
  return {{"success", static_cast<double>(successes) / static_cast<double>(group.size())},
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
          {"decision_p99_ms", 1e3 * quantile(decisions, 0.99)}};
}

void print_row(const std::string& formation, const std::string& strategy, const Group& group) {
  const auto m = metrics_of(group);
  fmt::print("{:<10}{:<15}{:>4}{:>9.0f} %{:>9.0f} %{:>9.2f} %{:>9.2f}{:>9.2f}{:>8.2f}{:>8.2f}{:>8.2f}\n", formation, strategy, group.size(),
             100 * m["success"].get<double>(), 100 * m["success_wilson_low"].get<double>(), 100 * m["lost_frac"].get<double>(),
             m["mean_time_s"].get<double>(), m["median_time_s"].get<double>(), m["strokes_mean"].get<double>(),
             m["hits_mean"].get<double>(), m["pushes_mean"].get<double>());
}

std::string csv(const std::vector<EpisodeRecord>& records) {
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

int run(const Arguments& arguments) {
  const auto settings = support::load_in_process_settings(arguments.config, arguments.overrides);
  auto formations = arguments.formations;
  if (formations.empty()) {
    formations = formation_names(settings.cell);
    formations.emplace_back("random");
  }
  std::vector<EpisodeSpec> specs;
  for (const auto& formation : formations) {
    for (int index = 0; index < arguments.n; ++index) {
      for (const auto& strategy : arguments.strategies) specs.push_back({formation, strategy, arguments.seed, index});
    }
  }
  WorldSpread spread;
  spread.random_discs = arguments.discs;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto progress = [&](std::size_t done, const EpisodeRecord& record) {
    if (terminal || done % 30 == 0 || done == specs.size()) {
      fmt::print(stderr, "{}{}/{} episodes, last: {} {} {}{}", terminal ? "\r\033[K" : "", done, specs.size(), record.spec.formation,
                 record.spec.strategy, record.success ? "singulated" : to_string(record.result.task.failure),
                 terminal && done != specs.size() ? "" : "\n");
    }
  };
  const auto records = run_episodes(settings, specs, spread, arguments.jobs, progress);

  fmt::print("{:<10}{:<15}{:>4}{:>11}{:>11}{:>11}{:>9}{:>9}{:>8}{:>8}{:>8}\n", "formation", "strategy", "n", "success", "Wilson >=", "lost",
             "mean s", "median s", "strokes", "hits", "pushes");
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
    print_row("all", strategy, all[strategy]);
    const nlohmann::json of_strategy = metrics_of(all[strategy]);
    for (const auto& [name, value] : of_strategy.items()) metrics[strategy + "." + name] = value;
  }
  for (const auto& other : {"random_hybrid", "random_push", "robust"}) {
    if (all.count("paper") == 0 || all.count(other) == 0) continue;
    const double ratio = metrics[std::string{other} + ".mean_time_s"].get<double>() / metrics["paper.mean_time_s"].get<double>();
    metrics[std::string{"ratio_"} + other + "_to_paper"] = ratio;
    fmt::print("mean time of {} over paper: {:.2f}\n", other, ratio);
  }
  fmt::print("(a failure counts as {:.0f} s; time of the cell clock, {:.0f} ms charged for each decision, {:.0f} ms for one of `robust`)\n",
             kFailureTime, 1e3 * to_seconds(settings.think_charge), 1e3 * to_seconds(settings.robust_think_charge));

  const nlohmann::json args{{"n", arguments.n},
                            {"seed", arguments.seed},
                            {"strategies", arguments.strategies},
                            {"formations", formations},
                            {"discs", arguments.discs}};
  if (!arguments.json_file.empty()) write_file(arguments.json_file, report("paper", args, metrics).dump(2) + "\n");
  if (!arguments.csv_file.empty()) write_file(arguments.csv_file, csv(records));
  return 0;
}

}  // namespace

}  // namespace breakshot::bench

int main(int argc, char** argv) {
  breakshot::bench::Arguments arguments;
  CLI::App app{
      "Runs the paper's strategy and its baselines over formations in the in-process cell (ODE world, rendered camera, real controller).",
      "bench paper"};
  app.add_option("--config", arguments.config, "The cell's configuration file")->capture_default_str();
  app.add_option("--set", arguments.overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);
  app.add_option("--n", arguments.n, "Episodes per formation and strategy")->check(CLI::Range(1, 10000))->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same episodes, bit by bit")->capture_default_str();
  app.add_option("--strategy", arguments.strategies, "Strategies, separated by commas")->delimiter(',')->capture_default_str();
  app.add_option("--formation", arguments.formations, "Formations, separated by commas; \"random\" for random clusters; default: all")
      ->delimiter(',');
  app.add_option("--discs", arguments.discs, "Discs of a random cluster")->check(CLI::Range(2, 20))->capture_default_str();
  app.add_option("--jobs", arguments.jobs, "Threads, each with a cell of its own")->check(CLI::Range(1, 64))->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  app.add_option("--csv", arguments.csv_file, "Write every episode to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return breakshot::bench::run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench paper: " << error.what() << '\n';
    return 1;
  }
}
