#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace breakshot {

/// SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014): 64 bits of state, period 2^64.
///
/// The standard library leaves it to each implementation how std::uniform_real_distribution turns bits into numbers. Here a seed means the
/// same formation, jitter and noise on every machine and with every compiler. Not for secrets.
class SplitMix64 {
 public:
  constexpr explicit SplitMix64(std::uint64_t seed) noexcept : state_{seed} {}

  constexpr std::uint64_t next() noexcept {
    state_ += 0x9e3779b97f4a7c15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }

  /// In [0, 1), all multiples of 2^-53 alike.
  constexpr double uniform() noexcept { return static_cast<double>(next() >> 11U) * 0x1.0p-53; }
  /// In [lo, hi).
  constexpr double uniform(double lo, double hi) noexcept { return lo + (hi - lo) * uniform(); }
  /// In [0, count); count > 0. The bias of the plain remainder is below count / 2^64.
  constexpr std::uint64_t below(std::uint64_t count) noexcept { return next() % count; }
  /// Normal with mean 0 and standard deviation 1 (Box and Muller 1958, one of the pair). Bit-identical only where libm is: unlike the rest
  /// of this class it calls transcendental functions.
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  /// A generator whose numbers have nothing to do with this one's; to give each part of a program its own.
  constexpr SplitMix64 split() noexcept { return SplitMix64{next()}; }

 private:
  std::uint64_t state_;
};

}  // namespace breakshot
