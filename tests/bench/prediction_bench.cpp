// `./breakshot bench prediction`: the virtual world, told everything, beside the simulator: how far its resting places are off, and what that is due to.

#include "common/gap.hpp"
#include "controller/motion/trajectory.hpp"
#include "planner/arm_filter.hpp"
#include "planner/strategy/sampled_worlds.hpp"
#include "planner/strategy/strokes.hpp"
#include "sim_bridge/arm/arm_dynamics.hpp"
#include "tests/bench/episodes.hpp"
#include "tests/bench/report.hpp"
#include "tests/bench/statistics.hpp"
#include "tests/support/stroke_rig.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>

namespace breakshot::bench {
namespace {

struct Arguments {
  std::string config = "config/cell.yaml";
  std::vector<std::string> overrides;
  int n = 100;
  std::uint64_t seed = 1;
  int discs = 6;
  std::string json_file;
};

/// Steps of the simulated table within one of the arm in the run that shows what its own steps are worth.
constexpr int kFineSteps = 64;
/// Worlds for a probability that was not chosen for being high, other than those that the stroke was chosen in.
constexpr std::size_t kFreshWorlds = 400;

/// What the virtual world is told of the striker.
struct Variant {
  const char* name;
  const char* metric;
  bool takes_time;  ///< the drives need their time to bring it back to its way
  bool stays;       ///< a disc that it meets slowly stays at it
  bool pose;        ///< its mass is that of the arm's pose instead of the planner's one
};
constexpr std::array kVariants{
    Variant{"back on its way at once, all bounces", "at_once", false, false, false},
    Variant{"drives take their time", "drives", true, false, false},
    Variant{"and what is met slowly stays: as planned with", "planned", true, true, false},
    Variant{"and the mass of the arm's pose", "pose", true, true, true},
};

/// Predicted beside simulated.
struct Compared {
  std::vector<double> error;                                          ///< of a resting place, mean over the discs, m
  int both = 0, neither = 0, only_predicted = 0, only_simulated = 0;  ///< strokes after which every gap is wide enough
};

std::vector<world::Disc> discs_of(const std::vector<SimDisc>& discs) {
  std::vector<world::Disc> out;
  for (const SimDisc& disc : discs) out.push_back({.p_WD = disc.p_WD, .radius = disc.radius, .mass = disc.mass});
  return out;
}

class PredictionBench {
 public:
  explicit PredictionBench(const Arguments& arguments)
      : arguments_{arguments},
        settings_{support::load_in_process_settings(arguments.config, arguments.overrides)},
        planner_{settings_.arm, settings_.cell.arm.X_WB, settings_.motion},
        filter_{planner_},
        dynamics_{settings_.arm, settings_.cell.arm.X_WB, settings_.sim.drives.rotor_inertia} {}

  void run() {
    WorldSpread spread = protocol_spread();
    spread.random.discs = arguments_.discs;
    spread.friction_map = 0.0;
    for (int i = 0; i < arguments_.n; ++i) play(draw_episode(settings_, {"random", "robust", arguments_.seed, i}, spread));
    print();
  }

 private:
  struct Rows {
    Compared fine;
    std::array<Compared, kVariants.size()> variants;
  };

  /// The first stroke of an episode, as `robust` decides it and the arm makes it.
  void play(const EpisodeDraw& draw) {
    sim_bridge::WorldSnapshot snapshot;
    for (const auto& disc : draw.formation.discs) {
      SimDisc one;
      one.p_WD = disc.p_WD;
      one.radius = disc.radius;
      one.height = settings_.cell.disc_height;
      one.mass = settings_.disc_mass * std::pow(disc.radius / settings_.disc_mass_radius, 2);
      snapshot.discs.push_back(one);
    }
    support::NoiseModelCamera camera{settings_.perception, settings_.perception_errors};
    const Scene scene = camera.look(snapshot, draw.world.seed);
    const auto option = decide(scene, draw.world.seed);
    if (!option || option->stroke.kind != StrokeKind::kHit) return;
    StrokeRequest stroke = option->stroke;
    stroke.id = 1;
    SplitMix64 random{draw.world.seed};
    stroke.speed *= 1.0 + random.uniform(-draw.world.stroke_speed_spread, draw.world.stroke_speed_spread);
    stroke.direction_W = Eigen::Rotation2Dd{random.uniform(-draw.world.aim_spread, draw.world.aim_spread)} * stroke.direction_W;
    const auto times = planner_.plan(stroke, settings_.motion.park, *trajectory_);
    if (!times) return;
    ++strokes_;
    said_.push_back(option->p_singulated);
    fresh_.push_back(in_fresh_worlds(scene, option->stroke, draw.world.seed));
    const auto touched = [&](const SimDisc& disc) { return (disc.p_WD - stroke.p_WS).norm() - disc.radius; };
    const auto struck = std::min_element(snapshot.discs.begin(), snapshot.discs.end(),
                                         [&](const SimDisc& a, const SimDisc& b) { return touched(a) < touched(b); });
    compare_all(alone_, draw, stroke, *times, {*struck});
    compare_all(cluster_, draw, stroke, *times, snapshot.discs);
  }

  strategy::DecisionContext context(std::uint64_t seed) {
    strategy::DecisionContext context;
    context.min_gap = settings_.cell.target_gap;
    context.region = settings_.cell.workspace;
    context.hits_left = 8;
    context.seed = seed;
    context.filter = &filter_;
    return context;
  }

  std::optional<strategy::StrokeOption> decide(const Scene& scene, std::uint64_t seed) {
    const auto decision = strategy::make_strategy("robust", settings_.strategy)->decide(scene, context(seed));
    return decision.options.empty() ? std::nullopt : std::optional{decision.options.front()};
  }

  double in_fresh_worlds(const Scene& scene, const StrokeRequest& stroke, std::uint64_t seed) {
    std::string why_not;
    const strategy::DecisionContext other = context(~seed);
    const auto model = strategy::model_of(scene, other.min_gap, settings_.strategy, why_not);
    strategy::SampledWorlds worlds{*model, scene, other, settings_.strategy};
    const auto forecast = filter_.forecast(stroke);
    std::size_t singulated = 0;
    for (std::size_t world = 1; world <= kFreshWorlds; ++world) {
      const auto aftermath = worlds.run(stroke, *forecast, world);
      singulated += aftermath.valid && aftermath.pairs_below == 0 && aftermath.outside == 0 ? 1 : 0;
    }
    return static_cast<double>(singulated) / kFreshWorlds;
  }

  void compare_all(Rows& rows, const EpisodeDraw& draw, const StrokeRequest& stroke, const motion::StrokeTimes& times,
                   const std::vector<SimDisc>& discs) {
    const auto simulated = simulate(draw, stroke, discs, settings_.sim.table_steps);
    compare(rows.fine, simulate(draw, stroke, discs, kFineSteps), simulated);
    for (std::size_t k = 0; k < kVariants.size(); ++k) {
      compare(rows.variants[k], predict(draw, stroke, times, discs_of(discs), kVariants[k]), simulated);
    }
    if (discs.size() > 1) singulated_.push_back(smallest_gap_between(simulated) >= settings_.cell.target_gap);
  }

  std::vector<world::Disc> simulate(const EpisodeDraw& draw, const StrokeRequest& stroke, const std::vector<SimDisc>& discs,
                                    int table_steps) const {
    support::StrokeRigSettings rig{settings_.arm, settings_.sim, settings_.loop, settings_.motion.tip_height, {}};
    rig.sim.physics = draw.world.physics;
    rig.sim.table_steps = table_steps;
    return discs_of(support::StrokeRig{rig}.run(stroke, *trajectory_, discs).discs);
  }

  std::vector<world::Disc> predict(const EpisodeDraw& draw, const StrokeRequest& stroke, const motion::StrokeTimes& times,
                                   std::vector<world::Disc> discs, const Variant& variant) const {
    world::WorldSettings physics = settings_.strategy.cell.world;
    physics.friction = draw.world.physics.friction;
    physics.restitution = draw.world.physics.restitution;
    physics.striker_restitution = draw.world.physics.striker_restitution;
    physics.touch_gap = world::WorldSettings{}.touch_gap;
    if (!variant.stays) physics.striker_bounce_speed = 0.0;
    world::StrikerRun run = strategy::striker_run(stroke, settings_.strategy.cell);
    strategy::follow_through(run, stroke, {to_seconds(times.total), times.low_after, to_seconds(times.low_time)});
    if (!variant.takes_time) run.bandwidth = 0.0;
    if (variant.pose) {
      const auto& contact = trajectory_->points[trajectory_->contact_tick];
      run.mobility = dynamics_.tip_mobility(dynamics_.posture(JointVector::Map(contact.q.data(), trajectory_->joints)));
    }
    world::VirtualWorld world{physics, world::make_impact_law("sequential")};
    const auto rollout = world.run(discs, &run);
    if (!rollout) throw std::runtime_error(rollout.error().text);
    for (std::size_t i = 0; i < discs.size(); ++i) discs[i].p_WD = rollout->p_WD[i];
    return discs;
  }

  void compare(Compared& row, const std::vector<world::Disc>& predicted, const std::vector<world::Disc>& simulated) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < predicted.size(); ++i) sum += (predicted[i].p_WD - simulated[i].p_WD).norm();
    row.error.push_back(sum / static_cast<double>(predicted.size()));
    const bool a = smallest_gap_between(predicted) >= settings_.cell.target_gap;
    const bool b = smallest_gap_between(simulated) >= settings_.cell.target_gap;
    ++(a ? (b ? row.both : row.only_predicted) : (b ? row.only_simulated : row.neither));
  }

  void print() {
    fmt::print(
        "Resting places in the virtual world, told the truth of everything, off those of the simulator; {} hits that `robust` chose\n\n",
        strokes_);
    fmt::print("{:<50}{:>16}{:>20}{:>22}\n", "", "struck disc alone", "cluster: p50, p90", "same verdict on gaps");
    line("the simulator itself with steps a sixteenth as long", "fine", alone_.fine, cluster_.fine);
    for (std::size_t k = 0; k < kVariants.size(); ++k)
      line(kVariants[k].name, kVariants[k].metric, alone_.variants[k], cluster_.variants[k]);
    fmt::print("\n");
    reliability("as promised", "said", said_);
    reliability("the same strokes in fresh worlds", "fresh", fresh_);
    const nlohmann::json args{{"n", arguments_.n}, {"seed", arguments_.seed}, {"discs", arguments_.discs}, {"set", arguments_.overrides}};
    if (!arguments_.json_file.empty()) write_file(arguments_.json_file, report("prediction", args, metrics_).dump(2) + "\n");
  }

  void line(const char* name, const std::string& metric, const Compared& alone, const Compared& cluster) {
    const double same = static_cast<double>(cluster.both + cluster.neither) / strokes_;
    metrics_[metric + ".alone_error_mm_p50"] = 1e3 * quantile(alone.error, 0.5);
    metrics_[metric + ".error_mm_p50"] = 1e3 * quantile(cluster.error, 0.5);
    metrics_[metric + ".error_mm_p90"] = 1e3 * quantile(cluster.error, 0.9);
    metrics_[metric + ".same_verdict"] = same;
    fmt::print("{:<50}{:>13.2f} mm{:>10.2f}, {:>4.1f} mm{:>20.0f} %\n", name, 1e3 * quantile(alone.error, 0.5),
               1e3 * quantile(cluster.error, 0.5), 1e3 * quantile(cluster.error, 0.9), 100.0 * same);
  }

  void reliability(const char* name, const std::string& metric, const std::vector<double>& p) {
    const Calibration found = calibration(p, singulated_);
    metrics_[metric + ".brier"] = found.brier;
    fmt::print("P(singulated) {}: {:.3f} on average, true in {:.3f}; Brier score {:.3f} (saying the mean: {:.3f})\n", name, mean(p),
               static_cast<double>(std::count(singulated_.begin(), singulated_.end(), true)) / static_cast<double>(strokes_), found.brier,
               found.brier_base);
  }

  Arguments arguments_;
  support::InProcessSettings settings_;
  motion::StrokePlanner planner_;
  planner::ArmFilter filter_;
  sim_bridge::ArmDynamics dynamics_;
  std::unique_ptr<motion::Trajectory> trajectory_ = std::make_unique<motion::Trajectory>();
  int strokes_ = 0;
  Rows alone_, cluster_;
  std::vector<double> said_, fresh_;
  std::vector<bool> singulated_;
  nlohmann::json metrics_;
};

}  // namespace
}  // namespace breakshot::bench

int main(int argc, char** argv) {
  using namespace breakshot::bench;
  Arguments arguments;
  CLI::App app{"The virtual world, told everything, beside the simulator", "bench prediction"};
  app.add_option("--config", arguments.config, "The cell's configuration file")->capture_default_str();
  app.add_option("--set", arguments.overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);
  app.add_option("--n", arguments.n, "Tables, one stroke each")->check(CLI::Range(1, 10000))->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same strokes")->capture_default_str();
  app.add_option("--discs", arguments.discs, "Discs of a table")->check(CLI::Range(2, 50))->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    PredictionBench{arguments}.run();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "bench prediction: " << error.what() << '\n';
    return 1;
  }
}
