// `./breakshot bench world`: how fast and how right the virtual world is, beside ODE and Box2D in the same process.
//
// Every scenario is a random compact cluster with gaps up to 0.2 mm or --gap, in which the outermost disc on one side starts towards the others. All
// scenarios are distinct: repeating a few flatters an event-driven engine twofold (physics.md 0).

#include "common/random.hpp"
#include "planner/world/virtual_world.hpp"
#include "tests/bench/report.hpp"
#include "tests/bench/statistics.hpp"
#include "tests/bench/stepped_tables.hpp"
#include "tests/planner/cluster_trials.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <cstdio>
#include <ctime>
#include <iostream>
#include <utility>

namespace breakshot::bench {

namespace {

struct Arguments {
  std::vector<int> n{6, 10, 20, 50, 200};
  std::uint64_t seed = 1;
  int repeats = 7;
  int accuracy = 40;
  long clusters = 0;
  std::vector<std::string> laws;
  double restitution = world::WorldSettings{}.restitution;
  double gap = 2e-4;      // m
  double map_cell = 0.0;  // m; 0: no friction map
  std::string json_file;
};

using Discs = std::vector<world::Disc>;

/// CPU time of this process, s: what others do on the machine counts less than with wall time.
double cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::vector<Discs> scenarios(int discs, int count, std::uint64_t seed, double largest_gap) {
  std::mt19937_64 random{seed * 1'000'003U + static_cast<std::uint64_t>(discs)};
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  std::vector<Discs> all;
  for (int i = 0; i < count; ++i) {
    Discs one = test::random_cluster(random, discs, largest_gap);
    const double bearing = uniform(-std::numbers::pi, std::numbers::pi);
    const Vector2 direction{std::cos(bearing), std::sin(bearing)};
    auto first = std::min_element(one.begin(), one.end(),
                                  [&](const auto& a, const auto& b) { return a.p_WD.dot(direction) < b.p_WD.dot(direction); });
    first->v_WD_W = uniform(0.5, 1.5) * direction;
    all.push_back(std::move(one));
  }
  return all;
}

/// A metre square of cells whose factors wander by 10 % over some decimetres, rounded to fiftieths as an estimate's would be; or none.
std::shared_ptr<const world::FrictionMap> friction_map(const Arguments& arguments) {
  if (arguments.map_cell == 0.0) return nullptr;
  const auto side = static_cast<std::size_t>(std::ceil(1.0 / arguments.map_cell));
  std::vector<double> factors;
  for (std::size_t i = 0; i < side * side; ++i) {
    const double x = static_cast<double>(i % side) * arguments.map_cell, y = static_cast<double>(i / side) * arguments.map_cell;
    factors.push_back(std::round(50.0 * (1.0 + 0.1 * std::sin(9.0 * x) * std::cos(7.0 * y))) / 50.0);
  }
  return std::make_shared<const world::FrictionMap>(Vector2{-0.5, -0.5}, arguments.map_cell, side, std::move(factors));
}

template <typename F>
double seconds_per_rollout(const std::vector<Discs>& all, F&& run) {
  const double began = cpu_time();
  for (const Discs& discs : all) run(discs);
  return (cpu_time() - began) / static_cast<double>(all.size());
}

/// Mean over the discs of how far they rest from where they should, um.
double error_um(std::span<const Vector2> p, std::span<const Vector2> reference) {
  double sum = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) sum += (p[i] - reference[i]).norm();
  return 1e6 * sum / static_cast<double>(p.size());
}

/// Rest positions against ODE at steps that halve, and at the step 0 that the last two point to (Richardson): what is ODE's own error shrinks with the
/// step, what is ours stays.
void compare_with_ode(const Arguments& arguments, world::VirtualWorld& ours, OdeTable& ode, nlohmann::json& metrics) {
  const auto clusters = scenarios(6, arguments.accuracy, arguments.seed + 1, arguments.gap);
  fmt::print("rest positions against ODE, {} clusters of 6:\n", clusters.size());
  const auto note = [&](const std::string& suffix, const std::string& what, const std::vector<std::vector<Vector2>>& rest) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < clusters.size(); ++i) errors.push_back(error_um(ours.run(clusters[i])->p_WD, rest[i]));
    metrics["error_um_p50" + suffix] = quantile(errors, 0.5);
    metrics["error_um_p90" + suffix] = quantile(errors, 0.9);
    fmt::print("  {:<22} median {:6.2f} um, p90 {:6.2f} um\n", what, quantile(errors, 0.5), quantile(errors, 0.9));
  };
  std::vector<std::vector<Vector2>> coarser, finer;
  for (const double step_us : {10.0, 5.0, 2.5}) {
    coarser = std::exchange(finer, {});
    for (const Discs& discs : clusters) finer.push_back(ode.run(discs, 1e-6 * step_us));
    note(step_us == 10.0 ? "" : fmt::format("_step_{:g}_us", step_us), fmt::format("at {:g} us", step_us), finer);
  }
  for (std::size_t i = 0; i < clusters.size(); ++i) {
    for (std::size_t k = 0; k < clusters[i].size(); ++k) finer[i][k] = 2.0 * finer[i][k] - coarser[i][k];
  }
  note("_extrapolated", "extrapolated to 0", finer);
}

std::vector<std::string> laws_that_keep_energy() {
  auto names = world::impact_law_names();
  std::erase_if(names, [](const auto& name) { return !world::make_impact_law(name)->keeps_energy_bound(); });
  return names;
}

/// Rollouts that are made to be hard, the same number under each law.
int run_trials(const Arguments& arguments) {
  bool good = true;
  for (const auto& name : arguments.laws) {
    const double began = cpu_time();
    const auto t = test::run_cluster_trials(name, arguments.clusters, arguments.seed);
    fmt::print(
        "{}: {} rollouts, {} at rest, {} of {} real overlaps refused, {} refused wrongly; most impacts {}; energy {:+.1e}, momentum "
        "{:.1e}, deepest overlap "
        "{:.1f} um; {:.0f} s\n",
        name, t.rollouts, t.at_rest, t.overlaps_refused, t.overlaps, t.wrongly_refused, t.most_impacts, t.energy_gain, t.momentum_error,
        -1e6 * t.smallest_gap, cpu_time() - began);
    std::fflush(stdout);  // it takes minutes
    good = good && t.at_rest == t.rollouts - t.overlaps && t.overlaps_refused == t.overlaps && t.energy_gain <= 1e-9 &&
           t.momentum_error <= 1e-12;
  }
  fmt::print("{}\n", good ? "all end, energy within 1e-9, momentum within 1e-12" : "MISSED: see above");
  return good ? 0 : 1;
}

int run(const Arguments& arguments) {
  if (arguments.clusters > 0) return run_trials(arguments);
  const world::WorldSettings settings{.friction_map = friction_map(arguments), .restitution = arguments.restitution};
  world::VirtualWorld ours{settings, world::make_impact_law("sequential")};
  OdeTable ode{settings.friction, settings.restitution};
  const Box2dTable box2d{settings.friction, settings.restitution};
  nlohmann::json metrics;
  double energy_gain = 0.0;
  std::vector<double> log_n, log_time;

  fmt::print("{:>5}{:>14}{:>12}{:>10}{:>14}{:>12}{:>12}\n", "discs", "rollouts/s", "us each", "impacts", "us/impact", "ODE 1 ms",
             "Box2D 1/240");
  for (const int n : arguments.n) {
    const auto all = scenarios(n, std::max(60, 24'000 / n), arguments.seed, arguments.gap);
    // The engines are so much slower that a part of the scenarios says enough.
    const std::vector<Discs> few{all.begin(), all.begin() + std::max(10, 600 / n)};
    std::vector<double> times, ode_ratios, box2d_ratios;
    long impacts = 0;
    for (int repeat = 0; repeat < arguments.repeats; ++repeat) {
      impacts = 0;
      times.push_back(seconds_per_rollout(all, [&](const Discs& discs) {
        const auto rollout = ours.run(discs);
        impacts += rollout->impacts;
      }));
      ode_ratios.push_back(seconds_per_rollout(few, [&](const Discs& discs) { ode.run(discs, 1e-3); }) / times.back());
      box2d_ratios.push_back(seconds_per_rollout(few, [&](const Discs& discs) { box2d.run(discs, 1.0 / 240.0); }) / times.back());
    }
    const double time = quantile(times, 0.5);
    const double per_impact = time * static_cast<double>(all.size()) / static_cast<double>(impacts);
    fmt::print("{:>5}{:>14.0f}{:>12.2f}{:>10.1f}{:>14.3f}{:>11.0f}x{:>11.0f}x\n", n, 1.0 / time, 1e6 * time,
               static_cast<double>(impacts) / static_cast<double>(all.size()), 1e6 * per_impact, quantile(ode_ratios, 0.5),
               quantile(box2d_ratios, 0.5));
    const std::string suffix = "_" + std::to_string(n);
    metrics["rollouts_per_s" + suffix] = 1.0 / time;
    metrics["us_per_collision" + suffix] = 1e6 * per_impact;
    metrics["ode_ratio" + suffix] = quantile(ode_ratios, 0.5);
    metrics["box2d_ratio" + suffix] = quantile(box2d_ratios, 0.5);
    if (n <= 50) {
      log_n.push_back(std::log(n));
      log_time.push_back(std::log(time));
    }
  }
  if (log_n.size() > 1) {
    metrics["growth_exponent"] = (log_time.back() - log_time.front()) / (log_n.back() - log_n.front());
    fmt::print("time of a rollout grows with N^{:.2f} up to {:.0f} discs\n", metrics["growth_exponent"].get<double>(),
               std::exp(log_n.back()));
  }

  world::VirtualWorld audited{world::WorldSettings{.restitution = arguments.restitution, .audit = true},
                              world::make_impact_law("sequential")};
  for (const int n : arguments.n) {
    for (const Discs& discs : scenarios(n, std::max(60, 24'000 / n), arguments.seed, arguments.gap)) {
      energy_gain = std::max(energy_gain, audited.run(discs)->energy_gain);
    }
  }

  compare_with_ode(arguments, ours, ode, metrics);
  fmt::print("largest gain of energy {:.1e}\n", energy_gain);
  metrics["energy_gain_max"] = energy_gain;

  nlohmann::json goals;
  const auto goal = [&](const char* name, double value, bool at_least) {
    if (!metrics.contains(name)) return;
    const double found = metrics[name].get<double>();
    goals[name] = {{"value", found}, {"goal", value}, {"met", at_least ? found >= value : found <= value}};
  };
  goal("rollouts_per_s_6", 1e6, true);
  goal("growth_exponent", 1.2, false);
  goal("us_per_collision_200", 3.0, false);
  goal("error_um_p50", 5.0, false);
  goal("error_um_p90", 20.0, false);
  goal("error_um_p50_extrapolated", 5.0, false);
  goal("energy_gain_max", 1e-9, false);
  for (const auto& [name, one] : goals.items()) {
    fmt::print("goal {:<22} {:>12.4g} {:>12.4g}  {}\n", name, one["goal"].get<double>(), one["value"].get<double>(),
               one["met"].get<bool>() ? "met" : "missed");
  }
  const nlohmann::json args{{"n", arguments.n}, {"seed", arguments.seed}, {"repeats", arguments.repeats}, {"accuracy", arguments.accuracy}};
  if (!arguments.json_file.empty()) write_file(arguments.json_file, report("world", args, metrics, goals).dump(2) + "\n");
  return 0;
}

}  // namespace

}  // namespace breakshot::bench

int main(int argc, char** argv) {
  breakshot::bench::Arguments arguments;
  arguments.laws = breakshot::bench::laws_that_keep_energy();
  CLI::App app{"Measures the virtual world on one core, beside ODE (QuickStep, 1 ms) and Box2D (1/240 s), and its accuracy.",
               "bench world"};
  app.add_option("--n", arguments.n, "Numbers of discs, separated by commas")
      ->delimiter(',')
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same scenarios")->capture_default_str();
  app.add_option("--repeats", arguments.repeats, "Passes over all scenarios; the median counts")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app.add_option("--accuracy", arguments.accuracy, "Clusters that ODE runs at steps of 10, 5 and 2.5 us")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--restitution", arguments.restitution, "e between discs")->check(CLI::Range(0.0, 1.0))->capture_default_str();
  app.add_option("--gap", arguments.gap, "Largest gap between neighbours, m; 0: they touch")
      ->check(CLI::Range(0.0, 0.01))
      ->capture_default_str();
  app.add_option("--map", arguments.map_cell,
                 "Side of the cells of a friction map, m; 0: mu is the same everywhere (ODE and Box2D know no map)")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--clusters", arguments.clusters,
                 "Instead of all else: so many random clusters under each impact law; do they end, and what of energy and momentum?")
      ->check(CLI::Range(1, 100'000'000));
  app.add_option("--law", arguments.laws, "Impact laws for --clusters, separated by commas: those that keep the energy bound")
      ->delimiter(',')
      ->check(CLI::IsMember(arguments.laws))
      ->capture_default_str();
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return breakshot::bench::run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench world: " << error.what() << '\n';
    return 1;
  }
}
