#include "controller/rt/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace breakshot::rt {

std::size_t Histogram::bin_of(std::uint64_t ns) noexcept {
  // Below 2^kSubBits each nanosecond has a bin of its own; above, the top kSubBits + 1 bits choose it.
  const auto width = static_cast<unsigned>(std::bit_width(ns));
  if (width <= kSubBits) return ns;
  if (width > kTopBit) return kBins - 1;
  const unsigned shift = width - kSubBits - 1;
  return (shift + 1) * kSubBins + ((ns >> shift) & (kSubBins - 1));
}

std::uint64_t Histogram::upper_bound_of(std::size_t bin) noexcept {
  if (bin < kSubBins) return bin;
  const std::size_t shift = bin / kSubBins - 1;
  const std::uint64_t lower = (kSubBins + bin % kSubBins) << shift;
  return lower + (std::uint64_t{1} << shift) - 1;
}

void Histogram::record(Duration span) noexcept {
  const std::int64_t ns = std::max<std::int64_t>(span.count(), 0);
  ++bins_[bin_of(static_cast<std::uint64_t>(ns))];
  ++count_;
  sum_ns_ += ns;
  max_ = std::max(max_, Duration{ns});
}

void Histogram::merge(const Histogram& other) noexcept {
  for (std::size_t i = 0; i < kBins; ++i) bins_[i] += other.bins_[i];
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
  max_ = std::max(max_, other.max_);
}

Duration Histogram::mean() const noexcept { return count_ == 0 ? Duration{} : Duration{sum_ns_ / static_cast<std::int64_t>(count_)}; }

Duration Histogram::quantile(double p) const noexcept {
  if (count_ == 0) return Duration{};
  const double share = p > 0.0 ? std::min(p, 1.0) : 0.0;
  const auto wanted = std::clamp<std::uint64_t>(static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_))), 1, count_);
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBins - 1; ++i) {
    seen += bins_[i];
    if (seen >= wanted) return std::min(max_, Duration{static_cast<std::int64_t>(upper_bound_of(i))});
  }
  return max_;  // the last bin has no upper bound
}

}  // namespace breakshot::rt
