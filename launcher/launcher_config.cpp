#include "launcher/launcher_config.hpp"

#include "common/process/exit_status.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace breakshot::launcher {

namespace {

/// The cell's processes; each has a program breakshot-<name>.
constexpr std::array<std::string_view, 6> kProcesses{"sim_bridge", "controller", "perception", "planner", "mes_gateway", "ros_gateway"};

std::string process_names() {
  std::string list;
  for (const std::string_view name : kProcesses) list.append(list.empty() ? "" : ", ").append(name);
  return list;
}

}  // namespace

LauncherConfig load_launcher_config(const ConfigNode& section) {
  constexpr Range kSeconds{0.01, 600.0};
  LauncherConfig config;
  config.ready_timeout = from_seconds(section.number("ready_timeout_s", kSeconds, "s"));
  config.stop_timeout = from_seconds(section.number("stop_timeout_s", kSeconds, "s"));
  config.watchdog = from_seconds(section.number("watchdog_s", {0.5, 600.0}, "s"));

  const ConfigNode restart = section.child("restart");
  config.restart.on_failure = restart.flag("on_failure");
  config.restart.delay = from_seconds(restart.number("delay_s", {0.0, 60.0}, "s"));
  config.restart.start_limit_burst = static_cast<int>(restart.integer("start_limit_burst", 1, 1000));
  config.restart.start_limit_interval = from_seconds(restart.number("start_limit_interval_s", {0.1, 3600.0}, "s"));
  config.restart.prevent_exit_codes = {process::kExitUsage, process::kExitRoleTaken, process::kExitConfig};

  const ConfigNode processes = section.child("processes");
  const std::vector<std::string> names = processes.keys();
  for (const std::string& name : names) {
    if (std::ranges::find(kProcesses, name) == kProcesses.end()) processes.refuse(name, "an unknown process", process_names());
    const ConfigNode entry = processes.child(name);
    config.processes.push_back({name, entry.texts("after"), entry.flag("enabled")});
    for (const std::string& other : config.processes.back().after) {
      const auto end = std::ranges::find(names, name);
      // Only what stands above: so the order in the file is a start order, and a circle cannot be written.
      if (std::find(names.begin(), end, other) == end) entry.refuse("after", other, "processes that stand above " + name);
    }
  }
  section.finish();
  return config;
}

std::vector<ProcessSpec> cell_processes(const LauncherConfig& config, const CellCommandLine& command_line) {
  const auto enabled = [&](const std::string& name) {
    return std::ranges::any_of(config.processes, [&](const ProcessEntry& entry) { return entry.name == name && entry.enabled; });
  };
  std::vector<ProcessSpec> specs;
  for (const ProcessEntry& entry : config.processes) {
    if (!entry.enabled) continue;
    ProcessSpec spec;
    spec.name = entry.name;
    spec.program = command_line.program_folder / ("breakshot-" + entry.name);
    spec.arguments = {"--config", command_line.config_file.string()};
    for (const std::string& text : command_line.overrides) spec.arguments.insert(spec.arguments.end(), {"--set", text});
    if (command_line.log_level != "info") spec.arguments.insert(spec.arguments.end(), {"--log-level", command_line.log_level});
    std::ranges::copy_if(entry.after, std::back_inserter(spec.after), enabled);
    spec.ready_timeout = config.ready_timeout;
    spec.stop_timeout = config.stop_timeout;
    spec.watchdog = config.watchdog;
    spec.restart = config.restart;
    specs.push_back(std::move(spec));
  }
  return specs;
}

}  // namespace breakshot::launcher
