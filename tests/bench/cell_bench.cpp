// `./breakshot bench cell`: the same episodes through the real processes, over real DDS in real time, and through the in-process cell.

#include "common/gap.hpp"
#include "tests/bench/comparison.hpp"
#include "tests/bench/report.hpp"
#include "tests/hil/cell_under_test.hpp"

#include <fmt/core.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>

namespace breakshot::bench {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string config = std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml";
  std::string strategy = "robust";
  std::string formation = "random";
  int discs = 6;
  int n = 30;
  std::uint64_t seed = 1;
  std::string json_file;
  std::string csv_file;
};

/// A folder with one formation in it, for as long as an episode lasts.
class FormationFolder {
 public:
  FormationFolder(const Formation& formation, const CellConfig& cell)
      : folder_{fs::temp_directory_path() / fmt::format("breakshot-bench-cell.{}", getpid())} {
    fs::create_directories(folder_);
    std::ofstream file{folder_ / "episode.yaml"};
    file << "formation:\n  description: of an episode\n  discs:\n";
    for (const auto& disc : formation.discs) {
      file << fmt::format("    - {{colour: {}, radius: {:.17g}, p_WD: [{:.17g}, {:.17g}]}}\n", cell.colours[disc.colour].name, disc.radius,
                          disc.p_WD.x(), disc.p_WD.y());
    }
    if (!file.flush()) throw std::runtime_error{"cannot write " + (folder_ / "episode.yaml").string()};
  }
  ~FormationFolder() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  FormationFolder(const FormationFolder&) = delete;
  FormationFolder& operator=(const FormationFolder&) = delete;
  FormationFolder(FormationFolder&&) = delete;
  FormationFolder& operator=(FormationFolder&&) = delete;

  std::string path() const { return folder_.string(); }

 private:
  fs::path folder_;
};

/// The cell's configuration, changed so that the simulator's truth is that of the episode.
std::vector<std::string> overrides_of(const EpisodeDraw& draw, const std::string& strategy, const std::string& formations) {
  const auto& physics = draw.world.physics;
  return {"cell.formations=" + formations,
          "sim_bridge.formation=episode",
          fmt::format("sim_bridge.physics.friction={:.17g}", physics.friction),
          fmt::format("sim_bridge.physics.friction_spread={:.17g}", physics.friction_spread),
          fmt::format("sim_bridge.physics.friction_seed={}", physics.friction_seed),
          fmt::format("sim_bridge.physics.restitution={:.17g}", physics.restitution),
          fmt::format("sim_bridge.camera.latency_ms={:.17g}", 1e3 * to_seconds(draw.world.camera_latency)),
          "planner.strategy=" + strategy};
}

/// Starts the cell, orders its table singulated, waits for the end, takes everything down. @throws std::runtime_error when the cell does not come up or falls silent
EpisodeRecord run_real(const support::InProcessSettings& settings, const EpisodeSpec& spec, const EpisodeDraw& draw) {
  const FormationFolder folder{draw.formation, settings.cell};
  hil::CellUnderTest cell{{overrides_of(draw, spec.strategy, folder.path()), {}, false}};
  dds::Reader<TaskStatus> tasks{cell.participant()};
  if (!cell.run_order()) throw std::runtime_error{"the real cell did not carry out an order:\n" + cell.logs()};
  EpisodeRecord record;
  record.spec = spec;
  record.friction = draw.world.physics.friction;
  record.restitution = draw.world.physics.restitution;
  record.min_gap = settings.cell.target_gap;
  // The planner repeats its final status; the gateway's job has ended, so it is out.
  TaskStatus& task = record.result.task;
  while (!is_final(task.phase)) {
    if (!tasks.take(task, std::chrono::seconds{5})) throw std::runtime_error{"the planner fell silent:\n" + cell.logs()};
  }
  const auto truth = cell.truth_at_rest();
  if (!truth) throw std::runtime_error{"the simulator fell silent or never rests:\n" + cell.logs()};
  record.result.truth = truth->discs;
  record.result.true_gap = smallest_gap_between(truth->discs);
  record.result.truly_lost = static_cast<int>(std::count_if(truth->discs.begin(), truth->discs.end(), [&](const SimDisc& disc) {
    return !disc.on_table || !settings.cell.workspace.contains(disc.p_WD);
  }));
  record.result.duration = task.ended - task.started;
  record.success = succeeded(task, record.result.truly_lost, record.result.true_gap, record.min_gap);
  record.time_s = record.success ? to_seconds(record.result.duration) : kFailureTime;
  return record;
}

Group group_of(const std::vector<EpisodeRecord>& records) {
  Group group;
  for (const auto& record : records) group.push_back(&record);
  return group;
}

int run(const Arguments& arguments) {
  auto settings = support::load_in_process_settings(arguments.config);
  // The real arm makes the stroke that it was asked for, so the in-process one does, too.
  WorldSpread spread = protocol_spread();
  spread.stroke_speed = 0.0;
  spread.aim = 0.0;
  spread.random.discs = arguments.discs;
  support::InProcessCell in_process{settings};
  std::vector<EpisodeRecord> real, simulated;
  for (int index = 0; index < arguments.n; ++index) {
    const EpisodeSpec spec{arguments.formation, arguments.strategy, arguments.seed, index};
    real.push_back(run_real(settings, spec, draw_episode(settings, spec, spread)));
    simulated.push_back(run_episode(in_process, spec, spread));
    const auto text = [](const EpisodeRecord& r) {
      return fmt::format("{:<11} {:6.2f} s {:2} strokes", r.success ? "singulated" : to_string(r.result.task.failure),
                         to_seconds(r.result.duration), r.result.task.hits + r.result.task.pushes);
    };
    fmt::print(stderr, "{:3}/{}  real processes: {}   in-process: {}\n", index + 1, arguments.n, text(real.back()), text(simulated.back()));
  }
  const Group reals = group_of(real);
  const Group simulateds = group_of(simulated);
  print_head();
  print_row(arguments.formation, "real", reals);
  print_row(arguments.formation, "in-process", simulateds);
  nlohmann::json metrics;
  for (const auto& [name, group] : {std::pair{"real.", &reals}, std::pair{"in_process.", &simulateds}}) {
    const nlohmann::json figures = metrics_of(*group);
    for (const auto& [key, value] : figures.items()) metrics[name + key] = value;
    fmt::print("{:<12} look {:.2f}, decide {:.2f}, move {:.2f}, settle {:.2f} s on average\n", name, figures["look_s"].get<double>(),
               figures["think_s"].get<double>(), figures["move_s"].get<double>(), figures["settle_s"].get<double>());
  }
  const Comparison found = compare(reals, simulateds);
  metrics["ratio_real_to_in_process"] = found.time.ratio;
  metrics["ratio_low"] = found.time.interval.low;
  metrics["ratio_high"] = found.time.interval.high;
  fmt::print("real over in-process: mean time {:.2f} (95 %: {:.2f} to {:.2f}); succeeded alone {} and {} times\n", found.time.ratio,
             found.time.interval.low, found.time.interval.high, found.only_a, found.only_b);
  const nlohmann::json args{{"n", arguments.n},
                            {"seed", arguments.seed},
                            {"strategy", arguments.strategy},
                            {"formation", arguments.formation},
                            {"discs", arguments.discs}};
  if (!arguments.json_file.empty())
    write_file(arguments.json_file, report("cell", args, metrics, {{"ratio_real_to_in_process", 1.1}}).dump(2) + "\n");
  if (!arguments.csv_file.empty()) write_file(arguments.csv_file, episodes_csv(real));
  return 0;
}

}  // namespace

}  // namespace breakshot::bench

int main(int argc, char** argv) {
  breakshot::bench::Arguments arguments;
  CLI::App app{
      "Plays episodes twice: through the real processes (started anew for each, real time, real DDS, an order from the factory's side, "
      "rendered "
      "camera) and in the in-process cell with the same table, friction, restitution and latency. The time is that of the cell clock, from "
      "order to end.",
      "bench cell"};
  app.add_option("--config", arguments.config, "The cell's configuration file")->capture_default_str();
  app.add_option("--n", arguments.n, "Episodes")->check(CLI::Range(1, 10000))->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same tables")->capture_default_str();
  app.add_option("--strategy", arguments.strategy, "Strategy")->capture_default_str();
  app.add_option("--formation", arguments.formation, "A formation's name, or \"random\"")->capture_default_str();
  app.add_option("--discs", arguments.discs, "Discs of a random cluster")->check(CLI::Range(2, 50))->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  app.add_option("--csv", arguments.csv_file, "Write every episode of the real processes to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return breakshot::bench::run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench cell: " << error.what() << '\n';
    return 1;
  }
}
