#pragma once

#include "common/time.hpp"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace breakshot::launcher {

/// When a process that had been READY dies, hangs or misses its watchdog: start it again, but not for ever. The names are systemd's.
struct RestartPolicy {
  bool on_failure = false;                                   ///< Restart=on-failure; false: Restart=no
  Duration delay = std::chrono::milliseconds{200};           ///< RestartSec
  int start_limit_burst = 5;                                 ///< at most so many starts, the first one included ...
  Duration start_limit_interval = std::chrono::seconds{30};  ///< ... within this time
  std::vector<int> prevent_exit_codes{};                     ///< RestartPreventExitStatus: it would only fail again (a bad configuration)
};

/// One process of a group, as a systemd unit would describe it.
struct ProcessSpec {
  std::string name;                                                ///< unique in its group; prefix of its log lines
  std::filesystem::path program;                                   ///< absolute, or relative to the working directory; PATH is not searched
  std::vector<std::string> arguments{};                            ///< without the program itself
  std::vector<std::pair<std::string, std::string>> environment{};  ///< added to, or replacing, the launcher's own
  std::vector<std::string> after{};                                ///< start when these are READY; stop before they do
  Duration ready_timeout = std::chrono::seconds{20};               ///< from exec to READY=1
  Duration stop_timeout = std::chrono::seconds{15};                ///< from SIGTERM to SIGKILL
  Duration watchdog{0};                                            ///< longest silence between two WATCHDOG=1 after READY; 0: not watched
  RestartPolicy restart{};
};

}  // namespace breakshot::launcher
