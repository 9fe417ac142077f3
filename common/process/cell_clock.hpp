#pragma once

#include "common/time.hpp"

#include <atomic>

namespace breakshot::process {

/// CLOCK_MONOTONIC as an instant of the cell clock. Async-signal-safe, no allocation.
Time monotonic_now() noexcept;

/// What time it is in the cell, for a process that is not the one that makes it.
///
/// Real-time mode: the monotonic clock. Lockstep mode: the newest stamp that this process has seen, because there time goes on only when the
/// simulator says so. Thread-safe, lock-free.
class CellTime {
 public:
  enum class Mode { kRealTime, kLockstep };
  explicit CellTime(Mode mode) noexcept : mode_{mode} {}

  Time now() const noexcept;
  /// Tells of a stamp seen on any topic. Older ones than the newest are ignored, so order does not matter.
  void observe(Time stamp) noexcept;
  Mode mode() const noexcept { return mode_; }

 private:
  Mode mode_;
  std::atomic<std::int64_t> newest_ns_{0};
};

}  // namespace breakshot::process
