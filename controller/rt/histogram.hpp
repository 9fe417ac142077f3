#pragma once

#include "common/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace breakshot::rt {

/// Histogram of time spans with fixed bins, for the tails that a mean and a deviation hide (p99.9, p99.99).
///
/// The bins are log-linear: 32 per power of two, so a quantile is right to 1/32 from 1 ns up to 68 s; spans below zero count as zero, longer ones
/// in the last bin. Recording is one increment, never allocates and costs a few nanoseconds. Trivially copyable (9 kB), so a snapshot
/// crosses threads through a TripleBuffer.
class Histogram {
 public:
  void record(Duration span) noexcept;
  void merge(const Histogram& other) noexcept;
  void clear() noexcept { *this = Histogram{}; }

  std::uint64_t count() const noexcept { return count_; }
  /// Exact, not a bin's bound; zero when empty.
  Duration max() const noexcept { return max_; }
  Duration mean() const noexcept;
  /// The smallest recordable bound that at least the share p of all spans keeps: never below the true quantile, at most 1/32 above it, and
  /// never above max(). p outside [0, 1] is taken as the nearer end. Zero when empty.
  Duration quantile(double p) const noexcept;

 private:
  static constexpr unsigned kSubBits = 5;
  static constexpr unsigned kSubBins = 1U << kSubBits;
  static constexpr unsigned kTopBit = 36;  // 2^36 ns = 68.7 s
  static constexpr std::size_t kBins = std::size_t{kTopBit - kSubBits + 1} * kSubBins;

  static std::size_t bin_of(std::uint64_t ns) noexcept;
  static std::uint64_t upper_bound_of(std::size_t bin) noexcept;

  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  std::int64_t sum_ns_ = 0;
  Duration max_{};
};

}  // namespace breakshot::rt
