#pragma once

#include <chrono>
#include <cstdint>

namespace breakshot {

/// A span of time, int64 nanoseconds; never a double.
using Duration = std::chrono::nanoseconds;

/// The clock of the cell. In real-time mode it is CLOCK_MONOTONIC, so all processes of one machine agree; in lockstep mode
/// it is whatever `sim_bridge` last stamped. It therefore has no now(): time is an input (see common/process/cell_clock.hpp).
struct CellClock {
  using duration = Duration;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<CellClock>;
  static constexpr bool is_steady = true;
};

/// An instant of the cell clock.
using Time = CellClock::time_point;

constexpr Time time_from_ns(std::int64_t ns) noexcept { return Time{Duration{ns}}; }
constexpr std::int64_t to_ns(Time time) noexcept { return time.time_since_epoch().count(); }

/// For formulas and for people; never to be converted back and compared.
constexpr double to_seconds(Duration duration) noexcept { return std::chrono::duration<double>(duration).count(); }

/// Rounds to the nearest nanosecond. The caller guarantees that seconds is finite and below 292 years.
constexpr Duration from_seconds(double seconds) noexcept {
  const double ns = seconds * 1e9;
  return Duration{static_cast<std::int64_t>(ns < 0 ? ns - 0.5 : ns + 0.5)};
}

}  // namespace breakshot
