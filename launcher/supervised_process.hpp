#pragma once

#include "launcher/child_process.hpp"
#include "launcher/notify_socket.hpp"
#include "launcher/process_spec.hpp"

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::launcher {

using Clock = std::chrono::steady_clock;

enum class ProcessState : std::uint8_t {
  kStopped,     ///< not started yet, or stopped as asked
  kStarting,    ///< runs, has not said READY=1
  kReady,       ///< runs and does its work
  kStopping,    ///< told to go, has not gone
  kRestarting,  ///< died; starts again after the policy's delay
  kExited,      ///< went by itself, cleanly, without being asked
  kFailed,      ///< died, and does not start again
};

const char* to_string(ProcessState state) noexcept;

/// What a watcher may know of a process; a copy.
struct ProcessInfo {
  std::string name;
  ProcessState state = ProcessState::kStopped;
  pid_t pid = 0;                     ///< 0 while none runs
  int restarts = 0;                  ///< since the group last asked for its start
  std::string status;                ///< its last STATUS=
  std::string reason;                ///< why it is kExited, kFailed or kRestarting: "killed by SIGSEGV"
  Clock::time_point started{};       ///< of the present or last life
  Duration ran{0};                   ///< length of the past lives together
  Duration cpu_time{0};              ///< of past lives together; of a running process see /proc
  std::uint64_t peak_rss_bytes = 0;  ///< largest of its past lives
};

/// Receives each finished line of a process's output, without the newline.
using LogSink = std::function<void(const std::string& name, const std::string& line)>;

/// The life of one process: starts it, hears its notifications, keeps its deadlines, restarts it by its policy.
///
/// Passive and single-threaded: whoever owns it calls the on_...() functions when its descriptors are readable or its deadline has come.
/// Time is an input.
class SupervisedProcess {
 public:
  SupervisedProcess(ProcessSpec spec, LogSink sink);

  const ProcessSpec& spec() const noexcept { return spec_; }
  const ProcessInfo& info() const noexcept { return info_; }
  const std::deque<std::string>& log() const noexcept { return log_; }
  bool running() const noexcept { return child_.has_value(); }
  /// Neither runs nor is about to.
  bool at_rest() const noexcept { return !child_ && info_.state != ProcessState::kRestarting; }
  /// At rest without having been asked.
  bool ended() const noexcept { return info_.state == ProcessState::kExited || info_.state == ProcessState::kFailed; }

  void start(Clock::time_point now);
  /// SIGTERM, and SIGKILL after the spec's stop_timeout. Whatever the process does, it is then at rest.
  void request_stop(Clock::time_point now);
  /// As from outside: what follows is decided by the restart policy.
  void send(int signal);

  /// Descriptors to watch while it runs, -1 for none.
  int notify_fd() const noexcept { return child_ ? notify_->fd() : -1; }
  int exit_fd() const noexcept { return child_ ? child_->exit_fd() : -1; }
  int output_fd() const noexcept { return output_open_ ? child_->output_fd() : -1; }

  void on_notify_readable(Clock::time_point now);
  void on_output_readable();
  void on_exit_readable(Clock::time_point now);
  void on_deadline(Clock::time_point now);
  /// The next instant at which on_deadline() has something to do.
  std::optional<Clock::time_point> deadline() const noexcept { return deadline_; }

 private:
  void spawn(Clock::time_point now);
  void give_up_on(std::string why, int signal, Clock::time_point now);
  void settle(const ExitStatus& status, Clock::time_point now);
  void keep_line(std::string line);

  ProcessSpec spec_;
  LogSink sink_;
  ProcessInfo info_;
  std::optional<NotifySocket> notify_;
  std::optional<ChildProcess> child_;
  bool output_open_ = false;
  std::string partial_line_;
  std::deque<std::string> log_;

  bool asked_to_stop_ = false;
  bool was_ready_ = false;              ///< in some life since start(): only then is a death worth a restart
  std::optional<std::string> verdict_;  ///< why we are ending it, when the reason is not in its exit status
  std::optional<Clock::time_point> deadline_;
  std::vector<Clock::time_point> starts_;
};

}  // namespace breakshot::launcher
