#pragma once

#include <optional>
#include <string>
#include <vector>

namespace breakshot::rt {

/// What keeps the scheduler and the pager away from the calling thread.
struct RealtimeSettings {
  int priority = 80;  ///< SCHED_FIFO, 1 to 99; above the kernel's threaded interrupts (50), below its migration and watchdog threads (99)
  int cpu = -1;       ///< core to stay on; -1: any
  std::optional<int> wake_latency_us = 0;                  ///< see WakeLatencyLimit
  std::size_t stack_bytes = std::size_t{512} * 1024;       ///< touched in advance, of the calling thread's stack
  std::size_t heap_bytes = std::size_t{16} * 1024 * 1024;  ///< touched in advance and kept by the allocator
};

/// A guarantee that could not be had.
struct MissingGuarantee {
  std::string what;    ///< "SCHED_FIFO priority 80: Operation not permitted"
  std::string effect;  ///< what may happen without it
  std::string remedy;  ///< how to grant it
};

/// Locks the process's memory - all of it, now and to come - and tells the allocator to give none back. Call it once, after the
/// threads and buffers exist and before the real-time thread starts.
/// @return what is missing; empty when all is well
std::vector<MissingGuarantee> lock_memory(const RealtimeSettings& settings);

/// Makes the calling thread real-time: SCHED_FIFO at the priority (read back to be sure), on its core, its stack touched.
/// @return what is missing; empty when all is well
std::vector<MissingGuarantee> make_thread_realtime(const RealtimeSettings& settings);

/// While it lives, the processor's cores do not sleep more deeply than they can wake from in time (the kernel's PM QoS, /dev/cpu_dma_latency, as
/// cyclictest and LinuxCNC ask of it). The wake-up from a deep sleep costs tens of microseconds, in a virtual machine that of any sleep some.
class WakeLatencyLimit {
 public:
  /// @param limit_us  0: cores that have nothing to do wait awake, which costs power; nothing: as deeply as they like
  explicit WakeLatencyLimit(std::optional<int> limit_us);
  ~WakeLatencyLimit();
  WakeLatencyLimit(const WakeLatencyLimit&) = delete;
  WakeLatencyLimit& operator=(const WakeLatencyLimit&) = delete;
  WakeLatencyLimit(WakeLatencyLimit&&) = delete;
  WakeLatencyLimit& operator=(WakeLatencyLimit&&) = delete;

  /// Empty when the kernel keeps the limit.
  const std::vector<MissingGuarantee>& missing() const noexcept { return missing_; }

 private:
  int file_ = -1;
  std::vector<MissingGuarantee> missing_;
};

}  // namespace breakshot::rt
