#pragma once

#include "launcher/unique_fd.hpp"

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace breakshot::launcher {

/// A command that runs on the launcher's own terminal, stdin and process group: Ctrl-C reaches it as it reaches the launcher.
/// It does not outlive the thread that started it.
class ForegroundCommand {
 public:
  /// @param words  the program, looked up in PATH, and its arguments
  /// @throws std::system_error when it cannot be started
  explicit ForegroundCommand(const std::vector<std::string>& words);
  /// Kills it if it still runs.
  ~ForegroundCommand();
  ForegroundCommand(const ForegroundCommand&) = delete;
  ForegroundCommand& operator=(const ForegroundCommand&) = delete;
  ForegroundCommand(ForegroundCommand&&) = delete;
  ForegroundCommand& operator=(ForegroundCommand&&) = delete;

  /// Readable once it has ended.
  int exit_fd() const noexcept { return pidfd_.get(); }
  void send(int signal) noexcept;
  /// Waits for its end. @return its exit status as a shell gives it: 128 + signal when it was killed
  int wait() noexcept;

 private:
  pid_t pid_ = -1;
  UniqueFd pidfd_;
};

}  // namespace breakshot::launcher
