#include "common/config/cell_config.hpp"
#include "common/process/exit_status.hpp"
#include "launcher/background.hpp"
#include "launcher/cell_control.hpp"
#include "launcher/launcher_config.hpp"
#include "launcher/run_directory.hpp"
#include "launcher/session.hpp"
#include "launcher/shm_files.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>

namespace {

using namespace breakshot;
using namespace breakshot::launcher;

void enable(LauncherConfig& config, const std::vector<std::string>& names, bool enabled) {
  for (const std::string& name : names) {
    const auto entry = std::ranges::find(config.processes, name, &ProcessEntry::name);
    if (entry == config.processes.end()) throw ConfigError{"--with, --without: found " + name + "; allowed: a name in launcher.processes"};
    entry->enabled = enabled;
  }
}

int clean_shared_memory() {
  const ShmCleanup cleanup = remove_stale_shm();
  std::printf("Shared memory of Fast DDS: %zu stale files removed, %zu in use.\n", cleanup.removed.size(), cleanup.in_use.size());
  for (const std::string& text : cleanup.failed) std::fprintf(stderr, "could not remove /dev/shm/%s\n", text.c_str());
  return cleanup.failed.empty() ? process::kExitOk : process::kExitFailure;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Starts, watches and stops the processes of the cell.", "breakshot-launch"};
  app.require_subcommand(1);
  SessionOptions options;
  std::vector<std::string> with;
  std::vector<std::string> without;
  // Beside this program, wherever it is installed.
  options.cell.program_folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();

  auto* run = app.add_subcommand("run", "Start the cell here; take it down on Ctrl-C or at the end of the command");
  auto* up = app.add_subcommand("up", "Start the cell in the background; return when every process is READY");
  auto* down = app.add_subcommand("down", "Take down the cell that runs in the background");
  auto* status = app.add_subcommand("status", "Show the processes of the cell");
  auto* clean = app.add_subcommand("clean-shm", "Remove shared-memory files that no process uses any more");
  for (CLI::App* sub : {run, up}) {
    sub->add_option("--config", options.cell.config_file, "The cell's configuration file")->required();
    sub->add_option("--set", options.cell.overrides, "Overrides one value of it in every process (repeatable)")->allow_extra_args(false);
    sub->add_option("--with", with, "Also start this process, which the configuration leaves out (repeatable)")->allow_extra_args(false);
    sub->add_option("--without", without, "Do not start this process (repeatable)")->allow_extra_args(false);
    sub->add_option("--log-level", options.cell.log_level, "trace, debug, info, warning, error or off")->capture_default_str();
    sub->add_option("--programs", options.cell.program_folder, "Folder of the processes' programs; default: this program's own");
  }
  run->add_flag("--quiet", options.quiet, "Show only the errors of the processes; their logs are in the run directory");
  run->add_flag("--usage", options.usage, "Print at the end the CPU time and memory that each process used");
  run->add_option("command", options.command, "A command (after --) to run once all are READY, and to end with");
  for (CLI::App* sub : {run, up, down, status}) {
    sub->add_option("--run-directory", options.run_directory, "Folder of the lock, the state and the logs")->capture_default_str();
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? process::kExitOk : process::kExitUsage;
  }

  try {
    if (*clean) return clean_shared_memory();
    if (*status) return show_cell(options.run_directory);
    if (*down) return stop_cell(options.run_directory, std::chrono::seconds{120});

    const ConfigDocument document = load_cell_document(options.cell.config_file, options.cell.overrides);
    options.launcher = load_launcher_config(document.section("launcher"));
    enable(options.launcher, with, true);
    enable(options.launcher, without, false);
    if (*run) return run_session(options);

    options.quiet = true;
    return run_in_background(options.run_directory / "log" / "launcher.log", [&](const std::function<void()>& ready) {
      try {
        options.on_ready = ready;
        return run_session(options);
      } catch (const std::exception& error) {
        std::printf("%s\n", error.what());
        return dynamic_cast<const AlreadyUp*>(&error) != nullptr ? process::kExitRoleTaken : process::kExitFailure;
      }
    });
  } catch (const ConfigError& error) {
    std::fprintf(stderr, "breakshot-launch: %s\n", error.what());
    return process::kExitConfig;
  } catch (const AlreadyUp& error) {
    std::fprintf(stderr, "breakshot-launch: %s\n", error.what());
    return process::kExitRoleTaken;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "breakshot-launch: %s\n", error.what());
    return process::kExitFailure;
  }
}
