#pragma once

#include "common/time.hpp"

#include <cstdint>
#include <string>

namespace breakshot {

enum class HealthState : std::uint8_t { kStarting = 0, kReady = 1, kDegraded = 2, kStopped = 3, kFault = 4 };

/// How long something takes, us: the median and the tail, since the start of the process. p9999: 99.99 % of the times are at most that.
struct LoopTail {
  double p50_us = 0.0, p99_us = 0.0, p999_us = 0.0, p9999_us = 0.0, max_us = 0.0;
};

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
  std::uint64_t overruns = 0;                           ///< periods of the main cycle that got no tick
  std::uint64_t overruns_ours = 0, overruns_hosts = 0;  ///< of these, by whose fault; both 0 where nobody tells them apart
  LoopTail wakeup;                                      ///< from the instant that the main cycle slept for to when it ran
  LoopTail compute;                                     ///< wall time of its work
  double cpu_s = 0.0;                                   ///< CPU time used since start
  std::uint64_t rss_bytes = 0;
  std::uint64_t dropped = 0;  ///< samples or frames that were not handled in time
};

const char* to_string(HealthState state) noexcept;

}  // namespace breakshot
