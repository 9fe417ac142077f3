#pragma once

#include "common/time.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <map>
#include <optional>

namespace breakshot::bench {

/// Wake-up latencies as cyclictest counts them: in whole microseconds, rounded down.
class LatencyCounts {
 public:
  LatencyCounts() = default;
  /// Reads what `cyclictest --histogram ... --json=FILE` wrote, all threads together.
  /// @throws std::runtime_error when that is not what it is
  explicit LatencyCounts(const nlohmann::json& report);

  void merge(const LatencyCounts& other);

  std::uint64_t count() const noexcept { return count_; }
  double max_us() const noexcept { return static_cast<double>(max_us_); }
  /// The upper end of the bin that the share p ends in, us: never below the true quantile, as rt::Histogram::quantile() is. Latencies beyond the
  /// last bin count as the largest. 0 when empty.
  double quantile_us(double p) const noexcept;

 private:
  std::map<std::int64_t, std::uint64_t> bins_;  ///< by microsecond
  std::uint64_t count_ = 0;                     ///< with those beyond the last bin
  std::int64_t max_us_ = 0;
};

/// Where and how both are measured.
struct LatencySettings {
  int priority = 80;  ///< SCHED_FIFO
  int cpu = 0;        ///< core
  Duration period = std::chrono::milliseconds{1};
  std::optional<int> wake_latency_us = 0;  ///< rt::WakeLatencyLimit of the loop; cyclictest asks for 0 by itself
};

/// Runs cyclictest (rt-tests) for a while.
/// @throws std::runtime_error when it is not installed or fails, with what to do
LatencyCounts run_cyclictest(const LatencySettings& settings, Duration span);

}  // namespace breakshot::bench
