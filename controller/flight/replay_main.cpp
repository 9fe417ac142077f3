#include "controller/flight/drive_lag.hpp"
#include "controller/flight/flight_files.hpp"
#include "controller/flight/replay.hpp"
#include "controller/loop/event_text.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <ctime>
#include <exception>
#include <fstream>
#include <string>

namespace breakshot::control::flight {
namespace {

enum Exit { kSame = 0, kDifferent = 1, kUnreadable = 2 };

/// Instants are told from the trigger, or from the first tick when that was elsewhere.
double since(const FlightRecord& record, Time time) {
  const std::size_t trigger = record.trigger_tick >= record.start.tick ? record.trigger_tick - record.start.tick : 0;
  return record.ticks.empty() ? 0.0 : to_seconds(time - record.ticks[std::min(trigger, record.ticks.size() - 1)].now);
}

void print(const FlightRecord& record) {
  const auto seconds = static_cast<std::time_t>(record.written_utc_ns / 1'000'000'000);
  fmt::print("{}: {}\n", to_string(record.trigger), record.why);
  fmt::print("written {:%Y-%m-%d %H:%M:%S} UTC by controller session {:016x}\n", fmt::gmtime(seconds), record.config.session);
  fmt::print("{} ticks of {} us, {} trajectories\n", record.ticks.size(), record.config.period / std::chrono::microseconds{1},
             record.trajectories.size());
}

void write_csv(const std::string& file, const FlightRecord& record) {
  std::ofstream out{file};
  const int joints = record.config.limits.joints;
  const char* const columns[] = {"measured_q", "measured_qd", "tau", "command_q", "command_qd", "command_qdd"};
  out << "time_s,tick,action,motion,stroke,state_seq,command_seq";
  for (const char* column : columns) {
    for (int j = 1; j <= joints; ++j) out << ',' << column << j;
  }
  out << '\n';
  for (const TickRecord& tick : record.ticks) {
    out << fmt::format("{:.6f},{},{},{},{},{},{}", since(record, tick.now), tick.tick, to_string(tick.action),
                       static_cast<int>(tick.motion), tick.stroke_id, tick.came ? tick.state.seq : 0, tick.command.seq);
    const auto put = [&](const JointVector& values, bool there) {
      for (int j = 0; j < joints; ++j) out << ',' << (there && j < values.size() ? fmt::format("{:.9g}", values[j]) : "");
    };
    put(tick.state.q, tick.came);
    put(tick.state.qd, tick.came);
    put(tick.state.tau, tick.came);
    put(tick.command.q, true);
    put(tick.command.qd, true);
    put(tick.command.qdd, true);
    out << '\n';
  }
  out.close();
  if (!out) throw std::runtime_error("cannot write " + file);
}

void print_lag(const FlightRecord& record) {
  const auto found = find_drive_lag(record.ticks, record.config.drive_lag);
  if (!found) {
    fmt::print("drives' lag: not to be told, {}\n", found.error());
    return;
  }
  const auto ms = [](Duration lag) { return 1e3 * to_seconds(lag); };
  fmt::print("drives' lag: {:.2f} ms (controller.drive_lag_ms: {:.2f}); by joint:", ms(found->lag), ms(record.config.drive_lag));
  for (const Duration lag : found->joint_lag) fmt::print(" {}", lag < Duration{} ? "-" : fmt::format("{:.2f}", ms(lag)));
  fmt::print("\n  from {} states; unexplained: {:.1f} urad rms, with the configured lag {:.1f} urad\n", found->states,
             1e6 * found->residual, 1e6 * found->residual_configured);
}

int run(int argc, char** argv) {
  CLI::App app{
      "Feeds a flight record of the controller through its control loop again and compares every command, bit for bit.\n"
      "Exit status: 0 all the same, 1 different, 2 the file cannot be read."};
  std::string file, csv;
  bool quiet = false;
  bool lag = false;
  app.add_option("FILE", file, "flight-...-stop.flight, as the controller writes it (controller.flight.folder)")->required();
  app.add_option("--csv", csv, "Also write states and commands as a table, one row per tick");
  app.add_flag("--quiet", quiet, "Leave out the events");
  app.add_flag("--lag", lag, "Also find the drives' lag from what was commanded and measured on trajectories");
  CLI11_PARSE(app, argc, argv);

  const auto record = load(file);
  if (!record) {
    fmt::print(stderr, "{}: {}\n", file, record.error());
    return kUnreadable;
  }
  print(*record);
  if (!csv.empty()) write_csv(csv, *record);
  if (lag) print_lag(*record);
  const auto result = replay(*record, [&](const LoopEvent& event) {
    if (!quiet) fmt::print("{:+9.3f} s  stroke {:<6} {}\n", since(*record, event.time), event.stroke_id, describe(event));
  });
  if (result.difference) {
    fmt::print("DIFFERENT at tick {}: {}\n", result.difference->tick, result.difference->what);
    return kDifferent;
  }
  fmt::print("same: {} ticks, {} commands, bit for bit\n", result.ticks, result.commands);
  return kSame;
}

}  // namespace
}  // namespace breakshot::control::flight

int main(int argc, char** argv) {
  try {
    return breakshot::control::flight::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return breakshot::control::flight::kUnreadable;
  }
}
