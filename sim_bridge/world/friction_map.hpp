#pragma once

#include "common/geometry.hpp"

#include <array>
#include <cstdint>

namespace breakshot::sim_bridge {

/// The friction coefficient of the table top as a function of place: constant, or with a smooth variation that a seed chooses.
class FrictionMap {
 public:
  /// @param mean    mu
  /// @param spread  largest relative deviation from it, 0 to 0.5
  FrictionMap(double mean, double spread, std::uint64_t seed);

  double at(const Vector2& p_W) const noexcept;

 private:
  struct Wave {
    Vector2 k;  // rad/m
    double phase;
  };
  /// Waves 0.2 to 0.6 m long: the scale of wear and dirt on a bench, and of several discs.
  static constexpr std::size_t kWaves = 6;

  double mean_, spread_;
  std::array<Wave, kWaves> waves_{};
};

}  // namespace breakshot::sim_bridge
