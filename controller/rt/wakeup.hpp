#pragma once

#include "common/time.hpp"

namespace breakshot::rt {

/// Lets the real-time thread wake one other thread without a lock: an eventfd. Signals that were not yet waited for add up to one.
class WakeupSignal {
 public:
  /// @throws std::system_error when the process has no file descriptor left
  WakeupSignal();
  ~WakeupSignal();
  WakeupSignal(const WakeupSignal&) = delete;
  WakeupSignal& operator=(const WakeupSignal&) = delete;
  WakeupSignal(WakeupSignal&&) = delete;
  WakeupSignal& operator=(WakeupSignal&&) = delete;

  /// Wakes the waiting thread. One non-blocking system call; any thread.
  void notify() noexcept;
  /// Waits for notify(), at most `timeout`. One waiting thread only.
  /// @return whether there was one
  bool wait(Duration timeout) noexcept;

 private:
  int fd_ = -1;
};

}  // namespace breakshot::rt
