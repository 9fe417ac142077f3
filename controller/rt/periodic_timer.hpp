#pragma once

#include "common/time.hpp"

#include <cstdint>

namespace breakshot::rt {

/// The tick that a wake-up stands for.
struct Wakeup {
  Time due{};                 ///< the newest instant of the grid that is not after the wake-up
  std::uint64_t skipped = 0;  ///< whole periods that passed since the due instant slept for, and that get no tick any more
};

/// The overrun policy, as a pure function.
///
/// Ticks lie on a fixed grid. Whoever wakes late - by his own work or by the host's - runs the tick of the period that he is in, if its instant
/// has come, and skips the whole periods before it. So the phase is kept for ever, no two ticks share a period, and nothing is caught up in a burst.
///
/// @param due     instant of the grid that was slept for
/// @param period  > 0
/// @param woke    when the sleep ended; before `due` (a clock that is read on another core may be) counts as on time
constexpr Wakeup settle_wakeup(Time due, Duration period, Time woke) noexcept {
  const auto late = woke - due;
  if (late < period) return {due, 0};
  const auto skipped = late / period;
  return {due + skipped * period, static_cast<std::uint64_t>(skipped)};
}

/// What PeriodicTimer::wait() gives.
struct TimerTick {
  Time due{};                 ///< of the tick to run now: what the control law is to take for "now"
  Time woke{};                ///< when the sleep really ended
  std::uint64_t skipped = 0;  ///< whole periods skipped before this tick
  int error = 0;              ///< 0, or the errno of clock_nanosleep: the timer is unusable and the caller must end

  /// From the instant slept for to the wake-up, which may be more than the period. (What cyclictest calls latency.)
  constexpr Duration lateness(Duration period) const noexcept { return woke - due + static_cast<std::int64_t>(skipped) * period; }
};

/// Now on CLOCK_MONOTONIC, which is the cell clock in real-time mode. About 20 ns, no system call (vDSO).
Time monotonic_now() noexcept;

/// CPU time of the calling thread: what a tick cost, whatever the host did meanwhile. A system call: not for the real-time path in operation.
Duration thread_cpu_now() noexcept;

/// Wakes the calling thread on a fixed grid of CLOCK_MONOTONIC.
class PeriodicTimer {
 public:
  /// @param period  > 0
  /// @param start   first instant of the grid; the first wait() returns there, or one whole number of periods later
  PeriodicTimer(Duration period, Time start) noexcept : period_{period}, next_{start} {}

  /// Sleeps until the next instant of the grid. One system call (clock_nanosleep, absolute: a pre-emption before the call costs no phase).
  TimerTick wait() noexcept;

 private:
  Duration period_;
  Time next_;
};

}  // namespace breakshot::rt
