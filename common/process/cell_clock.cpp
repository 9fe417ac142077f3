#include "common/process/cell_clock.hpp"

#include <ctime>

namespace breakshot::process {

Time monotonic_now() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return time_from_ns(static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec);
}

Time CellTime::now() const noexcept {
  if (mode_ == Mode::kRealTime) return monotonic_now();
  return time_from_ns(newest_ns_.load(std::memory_order_acquire));
}

void CellTime::observe(Time stamp) noexcept {
  const std::int64_t ns = to_ns(stamp);
  std::int64_t newest = newest_ns_.load(std::memory_order_relaxed);
  while (ns > newest && !newest_ns_.compare_exchange_weak(newest, ns, std::memory_order_release, std::memory_order_relaxed)) {
  }
}

}  // namespace breakshot::process
