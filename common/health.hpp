#pragma once

#include "common/time.hpp"

#include <cstdint>
#include <string>

namespace breakshot {

enum class HealthState : std::uint8_t { kStarting = 0, kReady = 1, kDegraded = 2, kStopped = 3, kFault = 4 };

/// What a process says of itself. Travels on `cell/health` at 10 Hz. Figures that a process has none of are 0.
struct Health {
  std::string process;  ///< "controller", ...; at most 31 characters
  HealthState state = HealthState::kStarting;
  std::string text;           ///< for people; at most 255 characters
  std::uint64_t session = 0;  ///< random per start
  std::uint64_t pid = 0;
  Time stamp{};
  Duration uptime{};
  double loop_hz = 0.0;  ///< of the process's main cycle, over the last second
  std::uint64_t cycles = 0;
  std::uint64_t overruns = 0;
  double wakeup_p99_us = 0.0, wakeup_max_us = 0.0;
  double compute_p99_us = 0.0, compute_max_us = 0.0;
  double cpu_s = 0.0;  ///< CPU time used since start
  std::uint64_t rss_bytes = 0;
  std::uint64_t dropped = 0;  ///< samples or frames that were not handled in time
};

const char* to_string(HealthState state) noexcept;

}  // namespace breakshot
