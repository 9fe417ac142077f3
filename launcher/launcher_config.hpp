#pragma once

#include "common/config/config_node.hpp"
#include "launcher/process_spec.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace breakshot::launcher {

/// One entry of launcher.processes.
struct ProcessEntry {
  std::string name;                ///< role in the cell; its program is breakshot-<name>
  std::vector<std::string> after;  ///< see ProcessSpec
  bool enabled = true;
};

/// Section `launcher` of the configuration.
struct LauncherConfig {
  Duration ready_timeout = std::chrono::seconds{20};
  Duration stop_timeout = std::chrono::seconds{15};
  Duration watchdog = std::chrono::seconds{10};
  RestartPolicy restart{};
  std::vector<ProcessEntry> processes{};
};

/// Reads section `launcher`. @throws ConfigError
LauncherConfig load_launcher_config(const ConfigNode& section);

/// What every process of the cell is started with.
struct CellCommandLine {
  std::filesystem::path program_folder;  ///< holds breakshot-sim_bridge and the others
  std::filesystem::path config_file;
  std::vector<std::string> overrides{};  ///< each "section.key=value"
  std::string log_level = "info";
};

/// The enabled processes as a ProcessGroup takes them. An `after` that names a disabled process is dropped.
std::vector<ProcessSpec> cell_processes(const LauncherConfig& config, const CellCommandLine& command_line);

}  // namespace breakshot::launcher
