#include "sim_bridge/world/friction_map.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace breakshot::sim_bridge {

FrictionMap::FrictionMap(double mean, double spread, std::uint64_t seed) : mean_{mean}, spread_{spread} {
  std::mt19937_64 random{seed};
  // Not std::uniform_real_distribution: its result is not the same in every standard library.
  const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(random() >> 11U) * 0x1p-53; };
  for (Wave& wave : waves_) {
    const double bearing = uniform(0.0, 2.0 * std::numbers::pi);
    const double number = 2.0 * std::numbers::pi / uniform(0.2, 0.6);
    wave = {number * Vector2{std::cos(bearing), std::sin(bearing)}, uniform(0.0, 2.0 * std::numbers::pi)};
  }
}

double FrictionMap::at(const Vector2& p_W) const noexcept {
  if (spread_ == 0.0) return mean_;
  double sum = 0.0;
  for (const Wave& wave : waves_) sum += std::cos(wave.k.dot(p_W) + wave.phase);
  return mean_ * (1.0 + spread_ * sum / static_cast<double>(kWaves));
}

}  // namespace breakshot::sim_bridge
