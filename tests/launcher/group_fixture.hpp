#pragma once

#include "launcher/pidfd.hpp"
#include "launcher/process_group.hpp"

#include <gtest/gtest.h>

#include <poll.h>

#include <string>
#include <vector>

namespace breakshot::launcher::testing {

/// Long enough for any machine; only a failing test waits so long.
inline constexpr Duration kPatience = std::chrono::seconds{20};
/// A bound that a test means to run out.
inline constexpr Duration kShort = std::chrono::milliseconds{100};

/// The dummy program with these words to do (see dummy.cpp).
inline ProcessSpec dummy(std::string name, std::vector<std::string> words, std::vector<std::string> after = {}) {
  ProcessSpec spec;
  spec.name = std::move(name);
  spec.program = LAUNCHER_DUMMY;
  spec.arguments = std::move(words);
  spec.after = std::move(after);
  spec.ready_timeout = kPatience;
  spec.stop_timeout = kPatience;
  return spec;
}

/// The policy of the units, without its delays.
inline RestartPolicy restart_at_once(int burst) {
  return {.on_failure = true,
          .delay = Duration{0},
          .start_limit_burst = burst,
          .start_limit_interval = std::chrono::hours{1},
          .prevent_exit_codes = {78}};
}

/// Whether the process is gone, or goes within kPatience.
inline bool goes(pid_t pid) {
  const UniqueFd fd{::pidfd_open(pid, 0)};
  if (!fd) return true;
  pollfd descriptor{fd.get(), POLLIN, 0};
  return ::poll(&descriptor, 1,
                static_cast<int>(std::chrono::milliseconds{std::chrono::duration_cast<std::chrono::milliseconds>(kPatience)}.count())) == 1;
}

}  // namespace breakshot::launcher::testing
