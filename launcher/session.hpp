#pragma once

#include "launcher/launcher_config.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace breakshot::launcher {

/// One run of the cell under this launcher.
struct SessionOptions {
  LauncherConfig launcher{};
  CellCommandLine cell{};
  std::filesystem::path run_directory{"run"};
  bool quiet = false;                  ///< show only the errors of the processes; their logs are in files anyway
  bool usage = false;                  ///< print at the end what each process used
  std::vector<std::string> command{};  ///< run this once all are READY, and end with it; empty: run until told to stop
  std::function<void()> on_ready{};    ///< called once all are READY
};

/// Starts the cell, keeps it up until SIGINT, SIGTERM, a process that fails for good or the end of the command, and takes it down.
///
/// Blocks SIGINT and SIGTERM for the calling thread, so it is to be called before any other thread exists.
/// @return the command's exit status; 0 after a signal without a command, 128 + signal when it cut a command short; 1 when the cell did
///         not come up or did not stay up
/// @throws AlreadyUp; std::system_error when the run directory cannot be written
int run_session(const SessionOptions& options);

}  // namespace breakshot::launcher
