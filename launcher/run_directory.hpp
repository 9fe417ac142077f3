#pragma once

#include "launcher/supervised_process.hpp"
#include "launcher/unique_fd.hpp"

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace breakshot::launcher {

/// A launcher already runs in this run directory.
class AlreadyUp : public std::runtime_error {
 public:
  explicit AlreadyUp(pid_t pid) : std::runtime_error{"the cell is already up (launcher process " + std::to_string(pid) + ")"}, pid_{pid} {}
  pid_t pid() const noexcept { return pid_; }

 private:
  pid_t pid_;
};

/// What a launcher tells `breakshot status` through its run directory.
struct CellState {
  pid_t launcher = 0;
  std::string phase;  ///< "starting", "up", "stopping"
  std::string config_file;
  std::int64_t started_utc_s = 0;
  std::vector<ProcessInfo> processes{};  ///< `started` is not carried over
};

/// The folder in which one launcher keeps its lock, its state and the logs of its processes. Made when missing.
class RunDirectory {
 public:
  /// Takes the folder's lock, which the kernel frees when this process ends, however it ends.
  /// @throws AlreadyUp, std::system_error when the folder cannot be written
  explicit RunDirectory(std::filesystem::path folder);

  /// Replaces the state in one step: a reader sees the old one or the new one. A full disk is not worth a cell: errors are ignored.
  void write(const CellState& state) const noexcept;

  /// Where a process's output goes; empty at the start of a run.
  std::filesystem::path log_file(const std::string& process) const;

  /// The pid of the launcher that holds the folder's lock; nothing when none does.
  static std::optional<pid_t> holder(const std::filesystem::path& folder);
  /// What the launcher last wrote; nothing when there is nothing readable.
  static std::optional<CellState> read(const std::filesystem::path& folder);

 private:
  std::filesystem::path folder_;
  UniqueFd lock_;
};

}  // namespace breakshot::launcher
