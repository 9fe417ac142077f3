#pragma once

#include "common/result.hpp"
#include "launcher/process_spec.hpp"
#include "launcher/unique_fd.hpp"

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>

namespace breakshot::launcher {

/// How a process ended and what it had used, its own waited-for children included.
struct ExitStatus {
  bool by_signal = false;
  int code = 0;  ///< exit code, or the signal's number
  Duration cpu_time{0};
  std::uint64_t peak_rss_bytes = 0;

  /// What systemd calls a clean exit: code 0, or one of the signals that ask a process to go.
  bool clean() const noexcept;
};

/// "exited with code 2", "killed by SIGSEGV".
std::string describe(const ExitStatus& status);

/// A running child: stdin is /dev/null, stdout and stderr come through one pipe, it leads a process group of its own, and the kernel kills
/// it (SIGKILL) when the thread that spawned it ends. So a launcher that is itself SIGKILLed leaves nothing behind; and the spawning thread
/// must outlive the child.
class ChildProcess {
 public:
  /// @return the child after a successful exec, or why there is none ("/x/y: No such file or directory")
  static Result<ChildProcess, std::string> spawn(const ProcessSpec& spec, const std::string& notify_address);

  ChildProcess(ChildProcess&&) noexcept = default;
  ChildProcess& operator=(ChildProcess&&) noexcept = default;

  pid_t pid() const noexcept { return pid_; }
  /// Readable once the process has ended.
  int exit_fd() const noexcept { return pidfd_.get(); }
  /// Read end of its output, non-blocking.
  int output_fd() const noexcept { return output_.get(); }

  /// To this process and never to another one that got its pid later.
  void send(int signal) noexcept;

  /// When it has ended: kills what is left of its process group, and reaps it. The object is then of no more use.
  std::optional<ExitStatus> try_reap() noexcept;

 private:
  ChildProcess(pid_t pid, UniqueFd pidfd, UniqueFd output) noexcept : pid_{pid}, pidfd_{std::move(pidfd)}, output_{std::move(output)} {}

  pid_t pid_;
  UniqueFd pidfd_;
  UniqueFd output_;
};

}  // namespace breakshot::launcher
