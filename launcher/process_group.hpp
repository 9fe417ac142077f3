#pragma once

#include "common/result.hpp"
#include "launcher/process_spec.hpp"
#include "launcher/supervised_process.hpp"

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace breakshot::launcher {

/// Why a group did not come up, or did not stay up.
struct LaunchFailure {
  std::string process;
  std::string reason;                   ///< "not READY within 20 s", "exited with code 78", ...
  std::string status;                   ///< the process's last STATUS=, may be empty
  std::vector<std::string> last_lines;  ///< of its output, at most 15

  /// All of it for a person, several lines.
  std::string text() const;
};

/// A set of processes that belong together: started in the order of their `after`, each when those before it are READY, restarted by their
/// policies, stopped in the reverse order.
///
/// One thread of its own supervises; every public function may be called from any thread, except from the log sink, which is called by
/// that thread. Nothing of the group outlives the object, nor the launcher's process.
class ProcessGroup {
 public:
  /// @param sink  called for each line of output; may be empty
  /// @throws std::invalid_argument for two processes of one name, or an `after` that names no process or goes in a circle
  explicit ProcessGroup(std::vector<ProcessSpec> specs, const LogSink& sink = {});
  /// Stops everything.
  ~ProcessGroup();
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;
  ProcessGroup(ProcessGroup&&) = delete;
  ProcessGroup& operator=(ProcessGroup&&) = delete;

  /// Starts what is not running, and returns when all are READY; when one cannot be, all are stopped again and the reason is returned.
  Result<Ok, LaunchFailure> start();
  /// Starts one, without a look at its `after`; on failure the others stay as they are.
  Result<Ok, LaunchFailure> start(const std::string& name);

  /// Stops all and returns when nothing runs. Bounded by the sum of the stop timeouts. Also ends a start() that waits in another thread.
  void stop();
  void stop(const std::string& name);

  /// A signal to one process, as if from outside: SIGKILL for "what if it dies", SIGSTOP for "what if it hangs".
  void send(const std::string& name, int signal);

  ProcessInfo info(const std::string& name) const;
  std::vector<ProcessInfo> infos() const;
  /// The last lines of its output, at most 2000, over all its lives.
  std::vector<std::string> log(const std::string& name) const;

  /// Waits until `condition` holds for the process. @return whether it came to hold before the timeout
  bool wait_until(const std::string& name, const std::function<bool(const ProcessInfo&)>& condition, Duration timeout) const;

  /// The first process that failed for good, or went by itself, since the last start(); if any.
  std::optional<LaunchFailure> failure() const;
  /// Readable once failure() has something to say: for a poll() beside other things.
  int failure_fd() const noexcept { return failure_fd_.get(); }

 private:
  void run();
  void step(Clock::time_point now);
  void start_what_may(Clock::time_point now);
  void stop_what_may(Clock::time_point now);
  int poll_timeout_ms(Clock::time_point now) const;
  LaunchFailure failure_of(const SupervisedProcess& process) const;
  SupervisedProcess& at(const std::string& name) const;
  Result<Ok, LaunchFailure> wait_ready(std::unique_lock<std::mutex>& lock, const std::set<std::string>& names);
  void wake() const noexcept;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::vector<std::unique_ptr<SupervisedProcess>> processes_;  ///< in start order
  std::set<std::string> to_start_;                             ///< to be started in their order, not started yet
  std::set<std::string> to_start_now_;                         ///< to be started at once, not started yet
  std::set<std::string> to_stop_;                              ///< to be stopped, not at rest yet
  std::optional<LaunchFailure> failure_;
  bool quit_ = false;
  UniqueFd wake_fd_;
  UniqueFd failure_fd_;
  std::thread thread_;
};

}  // namespace breakshot::launcher
