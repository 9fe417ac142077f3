#pragma once

#include "common/time.hpp"

#include <cstdint>

namespace breakshot::rt {

/// Periods that got no tick, by whose fault. (What is done about them: settle_wakeup().)
struct Overruns {
  std::uint64_t ours = 0;   ///< the tick before computed for that long
  std::uint64_t hosts = 0;  ///< the thread was ready to run, or in a tick, and the machine did something else
};

/// Whether a tick that took longer than its period did so by computing: it used the processor for at least half of the time.
///
/// @param wall  from the beginning to the end of the tick
/// @param cpu   CPU time of the thread meanwhile
constexpr bool overran_by_computing(Duration wall, Duration cpu) noexcept { return 2 * cpu >= wall; }

/// Tells our overruns from the host's without a system call in a tick that is in time.
///
/// The thread's CPU clock is read (a system call) ten times a second and at the end of a tick that took longer than its period; the ticks between the two
/// readings that were in time are taken off by their wall time, which is at least their CPU time. So a tick's own share is never over-estimated by more than the
/// timer's own work of a tenth of a second, some 0.3 ms.
class OverrunJudge {
 public:
  explicit OverrunJudge(Duration period) noexcept : period_{period} {}

  /// A reading of the thread's CPU clock, in passing.
  void read(Duration cpu_clock) noexcept {
    cpu_clock_ = cpu_clock;
    in_time_ = {};
  }
  /// Whether a tick of this length needs a reading: call late_tick() with it, else tick_in_time().
  bool is_late(Duration wall) const noexcept { return wall >= period_; }
  void tick_in_time(Duration wall) noexcept {
    in_time_ += wall;
    by_computing_ = false;
  }
  void late_tick(Duration wall, Duration cpu_clock) noexcept {
    by_computing_ = overran_by_computing(wall, cpu_clock - cpu_clock_ - in_time_);
    read(cpu_clock);
  }
  /// Books the periods that were skipped after the tick that was told of last.
  void skipped(std::uint64_t periods) noexcept { (by_computing_ ? overruns_.ours : overruns_.hosts) += periods; }

  const Overruns& overruns() const noexcept { return overruns_; }

 private:
  Duration period_;
  Duration cpu_clock_{};
  Duration in_time_{};  ///< wall time of the ticks since the last reading
  bool by_computing_ = false;
  Overruns overruns_;
};

}  // namespace breakshot::rt
