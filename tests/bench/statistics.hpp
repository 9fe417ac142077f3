#pragma once

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

}  // namespace breakshot::bench
