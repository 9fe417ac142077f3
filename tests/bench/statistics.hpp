#pragma once

#include "common/random.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace breakshot::bench {

/// A closed interval.
struct Interval {
  double low = 0.0, high = 0.0;
};

/// Wilson's score interval of a proportion (Wilson 1927), 95 %: right also when nearly all or nearly none succeed.
inline Interval wilson(std::size_t successes, std::size_t trials) noexcept {
  if (trials == 0) return {0.0, 1.0};
  constexpr double kZ = 1.959964;  // 97.5 % quantile of the normal distribution
  const double n = static_cast<double>(trials);
  const double p = static_cast<double>(successes) / n;
  const double middle = (p + kZ * kZ / (2 * n)) / (1 + kZ * kZ / n);
  const double half = kZ / (1 + kZ * kZ / n) * std::sqrt(p * (1 - p) / n + kZ * kZ / (4 * n * n));
  return {middle - half, middle + half};
}

inline double mean(const std::vector<double>& values) noexcept {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? std::numeric_limits<double>::quiet_NaN() : sum / static_cast<double>(values.size());
}

/// The value below which a share q of the values lies, by linear interpolation; NaN for none.
inline double quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double place = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

/// Ratio of the means of two paired samples, a over b, with the 95 % interval of the paired bootstrap (Efron 1979, percentiles): pairs are drawn
/// with replacement, so what makes an episode hard for both does not widen the interval.
struct PairedRatio {
  double ratio = 0.0;
  Interval interval;
};
inline PairedRatio paired_ratio(const std::vector<double>& a, const std::vector<double>& b, std::uint64_t seed = 1, int draws = 10'000) {
  SplitMix64 random{seed};
  std::vector<double> ratios;
  ratios.reserve(static_cast<std::size_t>(draws));
  for (int k = 0; k < draws; ++k) {
    double sum_a = 0.0;
    double sum_b = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto pick = static_cast<std::size_t>(random.below(a.size()));
      sum_a += a[pick];
      sum_b += b[pick];
    }
    ratios.push_back(sum_a / sum_b);
  }
  return {mean(a) / mean(b), {quantile(ratios, 0.025), quantile(ratios, 0.975)}};
}

/// McNemar's test for paired successes, exact and two-sided: how likely a split at least as uneven is when neither is better.
/// @param only_a, only_b  pairs in which just the one succeeded
inline double mcnemar(std::size_t only_a, std::size_t only_b) noexcept {
  const std::size_t n = only_a + only_b;
  double tail = 0.0;
  for (std::size_t k = 0; k <= std::min(only_a, only_b); ++k) {
    const auto choose =
        std::lgamma(static_cast<double>(n + 1)) - std::lgamma(static_cast<double>(k + 1)) - std::lgamma(static_cast<double>(n - k + 1));
    tail += std::exp(choose - static_cast<double>(n) * std::log(2.0));
  }
  return std::min(1.0, 2.0 * tail);
}

/// Predicted probabilities beside what happened.
struct Calibration {
  double brier = 0.0;       ///< mean squared error; 0 is perfect
  double brier_base = 0.0;  ///< of always saying the mean frequency: what a forecast has to beat
  struct Bin {
    double predicted = 0.0;  ///< mean prediction in it
    double happened = 0.0;   ///< frequency
    std::size_t count = 0;
  };
  std::vector<Bin> bins;  ///< those of ten equal ones that hold any; for a reliability plot
};
inline Calibration calibration(const std::vector<double>& predicted, const std::vector<bool>& happened) {
  Calibration result;
  std::vector<Calibration::Bin> bins(10);
  double frequency = 0.0;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    const double y = happened[i] ? 1.0 : 0.0;
    result.brier += (predicted[i] - y) * (predicted[i] - y);
    frequency += y;
    Calibration::Bin& bin = bins[std::min<std::size_t>(9, static_cast<std::size_t>(10.0 * predicted[i]))];
    bin.predicted += predicted[i];
    bin.happened += y;
    ++bin.count;
  }
  const auto n = static_cast<double>(predicted.size());
  result.brier /= n;
  frequency /= n;
  result.brier_base = frequency * (1.0 - frequency);
  for (auto& bin : bins) {
    if (bin.count == 0) continue;
    bin.predicted /= static_cast<double>(bin.count);
    bin.happened /= static_cast<double>(bin.count);
    result.bins.push_back(bin);
  }
  return result;
}

}  // namespace breakshot::bench
