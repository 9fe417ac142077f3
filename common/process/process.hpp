#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "common/process/cell_clock.hpp"
#include "common/process/exit_status.hpp"
#include "common/time.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace breakshot::process {

/// What run_process() hands to a process's body.
class Process {
 public:
  const ConfigDocument& config() const noexcept { return *config_; }
  const CellConfig& cell() const noexcept { return *cell_; }
  const std::string& name() const noexcept { return name_; }
  /// Random, new at each start: tells one life of a process from the next on the wire.
  std::uint64_t session() const noexcept { return session_; }
  CellTime& clock() noexcept { return clock_; }

  /// True once SIGTERM or SIGINT came, or stop() was called. Lock-free.
  bool stop_requested() const noexcept { return stop_.load(std::memory_order_relaxed); }
  /// Ends wait() and makes stop_requested() true.
  void stop() noexcept;
  /// Sleeps until the stop is requested or `duration` has passed. @return stop_requested()
  bool wait(Duration duration) noexcept;

  /// The process does its work from now on. Status is shown by systemctl and `./breakshot status`.
  void ready(const std::string& status);
  /// To be called often (at 10 Hz, say) by whoever knows that the process does its work; passes the word to the watchdog, if one listens.
  void alive() noexcept;

  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  Process(Process&&) = delete;
  Process& operator=(Process&&) = delete;
  ~Process() = default;

 private:
  friend int run_process(const struct ProcessInfo&, int, char**, const std::function<void(Process&)>&);
  Process(std::string name, const ConfigDocument& config, const CellConfig& cell);

  std::string name_;
  const ConfigDocument* config_;
  const CellConfig* cell_;
  std::uint64_t session_;
  CellTime clock_;
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> last_alive_ns_{0};
};

struct ProcessInfo {
  std::string name;         ///< "controller", ...: role in the cell and name in logs
  std::string description;  ///< one line for --help
};

/// A body throws this for what the user can put right; shown as it is, without "unexpected".
class ProcessError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Runs a process of the cell from its command line to its exit status.
///
/// Reads --config FILE, --set key=value (repeatable), --log-level; blocks SIGTERM and SIGINT in all threads and turns them into
/// Process::stop(); takes the role lock; starts logging; calls `body`; turns whatever it throws into one precise line and an exit status.
/// The body returns when Process::stop_requested() becomes true, having brought everything to rest.
int run_process(const ProcessInfo& info, int argc, char** argv, const std::function<void(Process&)>& body);

}  // namespace breakshot::process
