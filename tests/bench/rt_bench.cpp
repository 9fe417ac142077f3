// `./breakshot bench rt`: what the control loop's timing is worth, each part beside its yardstick in the same run.
//
// Ticks: the control law through strokes, refusals, stops, lost and spoilt states, reconnects and recoveries, as fast as it goes
//   (tests/controller/loop/watched_run), each tick under watch for heap calls, locks, system calls and page faults. Its time is the thread's CPU time; with
//   it comes the time to read that clock, a system call of some 0.3 us, from which nothing is subtracted.
// Round trip: a command until the state that acknowledges it, through the cell's own endpoints (common/dds) with the profile of cell/joint_command and
//   cell/joint_state, to a process that answers at once; beside bare Fast DDS with the same transport, QoS, types and scheduling (rt/bare_endpoint.hpp). Not through
//   sim_bridge: it answers at its next tick, and that wait of up to 1 ms would hide what the endpoints cost. rtt_ratio is that of the medians.
// Wake-up: the controller's loop thread beside cyclictest, alone and under stress-ng (rt/wakeup.hpp). Counted from the instant slept for on both sides; quantiles
//   are upper ends of bins on both sides, ours 1/32 wide, cyclictest's 1 us. Metrics: idle.wakeup_p99_ratio, stressed.wakeup_p99_ratio and so on;
//   wakeup_p99_ratio and wakeup_p999_ratio are the larger of the two.

#include "common/config/cell_config.hpp"
#include "controller/controller_config.hpp"
#include "tests/bench/report.hpp"
#include "tests/bench/rt/child_program.hpp"
#include "tests/bench/rt/round_trip.hpp"
#include "tests/bench/rt/wakeup.hpp"
#include "tests/controller/loop/watched_run.hpp"

#include <fmt/core.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <array>
#include <cstdio>
#include <iostream>
#include <optional>
#include <thread>

namespace breakshot::bench {
namespace {

struct Arguments {
  std::string config = "config/cell.yaml";
  std::vector<std::string> overrides;
  int seconds = 60;
  int ticks = 10'000'000;
  int round_trips = 20'000;
  unsigned seed = 1;
  int cpu = static_cast<int>(std::thread::hardware_concurrency()) - 1;
  bool no_ticks = false, no_round_trip = false, no_wakeup = false, no_stress = false;
  std::string json_file;
  // How this program starts itself for the other side of the round trip.
  std::string echo;
  int echo_domain = 0, echo_priority = 1;
};

double us(Duration span) noexcept { return 1e6 * to_seconds(span); }

/// The quantiles that tables and metrics show.
struct Share {
  double p;
  const char* metric;
  const char* title;
};
constexpr std::array<Share, 5> kShares{
    {{0.5, "p50", "p50"}, {0.99, "p99", "p99"}, {0.999, "p999", "p99.9"}, {0.9999, "p9999", "p99.99"}, {0.99999, "p99999", "p99.999"}}};
/// p99.999 takes 10^7 of them: ticks only.
constexpr std::size_t kWakeupShares = 4;

class Bench {
 public:
  explicit Bench(const Arguments& arguments) : arguments_{arguments} {}

  void measure_ticks() {
    control::test::WatchedRun run;
    // In a thread of its own: the watch on system calls stays on a thread.
    std::thread{[&] { run = control::test::run_watched(arguments_.ticks, arguments_.seed); }}.join();
    const auto& sins = run.sins;
    metrics_["ticks"] = run.compute.count();
    for (const Share& share : kShares) metrics_[fmt::format("tick_{}_us", share.metric)] = us(run.compute.quantile(share.p));
    metrics_["tick_max_us"] = us(run.compute.max());
    metrics_["heap_calls"] = sins.calls.heap;
    metrics_["lock_calls"] = sins.calls.mutexes;
    if (run.watched_system_calls) metrics_["system_calls"] = sins.system.calls;
    if (run.watched_faults) metrics_["page_faults"] = sins.faults;
    ours_ += run.overruns.ours;

    fmt::print("{} ticks: {} strokes, {} refused, {} stops, {} recoveries, {} restarts of the drives\n", run.compute.count(), run.started,
               run.refused, run.stopped, run.recovered, run.restarted);
    fmt::print(
        "  {} heap calls, {} locks, {} system calls, {} page faults; longer than a period: {} by computing, {} held up by the host\n",
        sins.calls.heap, sins.calls.mutexes,
        run.watched_system_calls ? std::to_string(sins.system.calls) : "(not watched: needs Linux 5.11 on x86-64)",
        run.watched_faults ? std::to_string(sins.faults) : "(not watched: memory cannot be locked)", run.overruns.ours, run.overruns.hosts);
    fmt::print("  CPU time, us: ");
    for (const Share& share : kShares) fmt::print(" {} {:.2f} ", share.title, us(run.compute.quantile(share.p)));
    fmt::print(" max {:.1f}\n\n", us(run.compute.max()));
  }

  void measure_round_trip(int io_priority) {
    // A domain of this process's own, out of those that the cell's defaults leave alone.
    const int domain = 100 + static_cast<int>(getpid() % 130);
    const RoundTrips trips = measure_round_trips({.count = arguments_.round_trips, .domain = domain, .priority = io_priority});
    fmt::print("{:<26}{:>9}{:>9}{:>9}{:>9}{:>9}\n", "round trip, us", "p50", "p99", "p99.9", "max", "lost");
    const auto row = [&](const char* name, const std::string& metric, const rt::Histogram& h, std::uint64_t lost) {
      fmt::print("{:<26}{:>9.1f}{:>9.1f}{:>9.1f}{:>9.1f}{:>9}\n", name, us(h.quantile(0.5)), us(h.quantile(0.99)), us(h.quantile(0.999)),
                 us(h.max()), lost);
      metrics_[metric + "_p50_us"] = us(h.quantile(0.5));
      metrics_[metric + "_p99_us"] = us(h.quantile(0.99));
      metrics_[metric + "_lost"] = lost;
    };
    row("the cell's endpoints", "rtt", trips.ours, trips.lost_ours);
    row("bare Fast DDS", "bare_rtt", trips.bare, trips.lost_bare);
    metrics_["rtt_ratio"] = trips.ratio(0.5);
    metrics_["rtt_p99_ratio"] = trips.ratio(0.99);
    fmt::print("{:<26}{:>9.2f}{:>9.2f}{:>9.2f}\n\n", "ratio", trips.ratio(0.5), trips.ratio(0.99), trips.ratio(0.999));
  }

  void measure_wakeup(const control::ControllerConfig& config) {
    LatencySettings settings{config.realtime.priority, arguments_.cpu};
    settings.wake_latency_us = config.realtime.wake_latency_us;
    fmt::print("{:<26}", "wake-up, us");
    for (std::size_t i = 0; i < kWakeupShares; ++i) fmt::print("{:>9}", kShares[i].title);
    fmt::print("{:>9}{:>9}{:>7}\n", "max", "count", "load");
    const auto span = std::chrono::seconds{arguments_.seconds};
    put("idle", compare_wakeups(settings, config.io_priority, span));
    if (!arguments_.no_stress) {
      const ChildProgram stress{"stress-ng", "stress-ng", {"--cpu", "2", "--vm", "1", "--io", "1"}};
      std::this_thread::sleep_for(std::chrono::seconds{2});  // until its processes run
      put("stressed", compare_wakeups(settings, config.io_priority, span));
    }
    fmt::print("\n");
    for (const char* name : {"wakeup_p99_ratio", "wakeup_p999_ratio"}) {
      double worst = 0.0;
      for (const char* when : {"idle.", "stressed."}) {
        if (metrics_.contains(std::string{when} + name)) worst = std::max(worst, metrics_[std::string{when} + name].get<double>());
      }
      metrics_[name] = worst;
    }
  }

  void print_goals() {
    metrics_["overruns_ours"] = ours_;
    const auto goal = [&](const char* name, double bound, bool at_least = false) {
      if (!metrics_.contains(name)) return;
      const double value = metrics_[name].get<double>();
      const bool met = at_least ? value >= bound : value <= bound;
      goals_[name] = {{"value", value}, {"goal", bound}, {"met", met}};
      fmt::print("{:<28}{:>10.4g}   goal {} {:<8.4g}{}\n", name, value, at_least ? "at least" : "at most", bound, met ? "" : "   missed");
    };
    goal("ticks", 1e7, true);
    goal("tick_p99999_us", 100.0);
    for (const char* none : {"heap_calls", "lock_calls", "system_calls", "page_faults", "overruns_ours"}) goal(none, 0.0);
    goal("rtt_ratio", 1.3);
    for (const char* ratio : {"idle.wakeup_p99_ratio", "idle.wakeup_p999_ratio", "stressed.wakeup_p99_ratio", "stressed.wakeup_p999_ratio"})
      goal(ratio, 1.2);
  }

  const nlohmann::json& metrics() const noexcept { return metrics_; }
  const nlohmann::json& goals() const noexcept { return goals_; }

 private:
  void put(const std::string& when, const WakeupComparison& found) {
    const auto row = [&](const std::string& name, auto&& quantile, double max, std::uint64_t count) {
      fmt::print("{:<26}", name);
      for (std::size_t i = 0; i < kWakeupShares; ++i) fmt::print("{:>9.1f}", quantile(kShares[i].p));
      fmt::print("{:>9.0f}{:>9}", max, count);
    };
    row(
        when + ": control loop", [&](double p) { return us(found.loop.quantile(p)); }, us(found.loop.max()), found.loop.count());
    fmt::print("{:>7.1f}\n", found.load);
    row(
        when + ": cyclictest", [&](double p) { return found.yardstick.quantile_us(p); }, found.yardstick.max_us(), found.yardstick.count());
    fmt::print("\n{:<26}", when + ": ratio");
    for (std::size_t i = 0; i < kWakeupShares; ++i) {
      const Share& share = kShares[i];
      fmt::print("{:>9.2f}", found.ratio(share.p));
      metrics_[fmt::format("{}.wakeup_{}_us", when, share.metric)] = us(found.loop.quantile(share.p));
      metrics_[fmt::format("{}.cyclictest_{}_us", when, share.metric)] = found.yardstick.quantile_us(share.p);
      metrics_[fmt::format("{}.wakeup_{}_ratio", when, share.metric)] = found.ratio(share.p);
    }
    fmt::print("   overruns: {} ours, {} the host's\n", found.overruns.ours, found.overruns.hosts);
    if (found.turns_not_ready > 0) fmt::print("{}: in {} turns the loop stood in a stop at the end\n", when, found.turns_not_ready);
    metrics_[when + ".wakeup_max_us"] = us(found.loop.max());
    metrics_[when + ".cyclictest_max_us"] = found.yardstick.max_us();
    metrics_[when + ".overruns_hosts"] = found.overruns.hosts;
    metrics_[when + ".cycles"] = found.loop.count();
    metrics_[when + ".load"] = found.load;
    ours_ += found.overruns.ours;
  }

  const Arguments& arguments_;
  nlohmann::json metrics_, goals_ = nlohmann::json::object();
  std::uint64_t ours_ = 0;
};

int run(const Arguments& arguments) {
  const ConfigDocument document = load_cell_document(arguments.config, arguments.overrides);
  const control::ControllerConfig config = control::load_controller_config(document, load_cell_config(document));
  // What is missing is said now and not after a minute.
  if (!arguments.no_wakeup) {
    require_realtime({config.realtime.priority, arguments.cpu});
    if (!arguments.no_stress) find_program("stress-ng", "stress-ng");
  }
  Bench bench{arguments};
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // it takes minutes, and whoever reads it through a pipe waits as well
  if (!arguments.no_ticks) bench.measure_ticks();
  if (!arguments.no_round_trip) bench.measure_round_trip(config.io_priority);
  if (!arguments.no_wakeup) bench.measure_wakeup(config);
  bench.print_goals();
  const nlohmann::json args{{"seconds", arguments.seconds}, {"ticks", arguments.ticks}, {"round_trips", arguments.round_trips},
                            {"seed", arguments.seed},       {"cpu", arguments.cpu},     {"priority", config.realtime.priority}};
  if (!arguments.json_file.empty()) write_file(arguments.json_file, report("rt", args, bench.metrics(), bench.goals()).dump(2) + "\n");
  return 0;
}

}  // namespace
}  // namespace breakshot::bench

int main(int argc, char** argv) {
  breakshot::bench::Arguments arguments;
  CLI::App app{
      "The control loop's timing: ticks under watch, the round trip beside bare Fast DDS, the wake-up beside cyclictest, alone and under "
      "stress-ng. Needs the right to SCHED_FIFO and locked memory (root has it).",
      "bench rt"};
  app.add_option("--config", arguments.config, "The cell's configuration file (for the priorities and the limit on sleep)")
      ->capture_default_str();
  app.add_option("--set", arguments.overrides, "Overrides one value of it (repeatable)")->allow_extra_args(false);
  app.add_option("--seconds", arguments.seconds, "Of wake-ups, for the loop and for cyclictest each, idle and stressed each")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  app.add_option("--ticks", arguments.ticks, "Accelerated ticks")->check(CLI::Range(1000, 1'000'000'000))->capture_default_str();
  app.add_option("--round-trips", arguments.round_trips, "Round trips of either kind")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  app.add_option("--seed", arguments.seed, "The same seed gives the same ticks")->capture_default_str();
  app.add_option("--cpu", arguments.cpu, "Core for the loop and cyclictest")->check(CLI::Range(0, 1023))->capture_default_str();
  app.add_flag("--no-ticks", arguments.no_ticks, "Leaves out the ticks");
  app.add_flag("--no-round-trip", arguments.no_round_trip, "Leaves out the round trip");
  app.add_flag("--no-wakeup", arguments.no_wakeup, "Leaves out the wake-up");
  app.add_flag("--no-stress", arguments.no_stress, "Leaves out the wake-up under stress-ng");
  app.add_option("--json", arguments.json_file, "Write the metrics to this file");
  app.add_option("--echo", arguments.echo, "")->group("")->check(CLI::IsMember({"ours", "bare"}));
  app.add_option("--echo-domain", arguments.echo_domain, "")->group("");
  app.add_option("--echo-priority", arguments.echo_priority, "")->group("");
  CLI11_PARSE(app, argc, argv);
  try {
    using breakshot::bench::Link;
    if (!arguments.echo.empty())
      breakshot::bench::run_echo(arguments.echo == "ours" ? Link::kOurs : Link::kBare, arguments.echo_domain, arguments.echo_priority);
    return breakshot::bench::run(arguments);
  } catch (const std::exception& error) {
    std::cerr << "bench rt: " << error.what() << '\n';
    return 1;
  }
}
