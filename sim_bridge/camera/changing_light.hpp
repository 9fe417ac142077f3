#pragma once

#include "common/time.hpp"
#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/light.hpp"
#include "sim_bridge/camera/projector.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace breakshot::sim_bridge {

/// How brightness and white balance change with time. The same settings, seed and time give the same exposure.
class Drift {
 public:
  /// @throws CameraError when a setting is out of its range
  Drift(const DriftSettings& settings, std::uint64_t seed);

  bool active() const { return settings_.brightness_ramp != 1.0 || settings_.white_balance > 0.0; }
  /// What becomes of an exposure at a time; nothing beyond kMaxBrightness.
  Exposure at(Exposure exposure, Time time) const;

 private:
  DriftSettings settings_;
  double red_phase_, blue_phase_;  ///< of the swings, turns
};

/// The wandering shadow, as a factor on the finished picture: it takes from every pixel what it takes from the table there. (On the arm, which is
/// higher, it so falls a little aside; its edges are softer than that shows.) The factor is found every kStep pixels and interpolated.
class MovingShadow {
 public:
  /// @throws CameraError when a setting is out of its range
  MovingShadow(const MovingShadowSettings& settings, const Light& light, const Projector& projector, std::uint64_t seed);

  bool active() const { return settings_.depth > 0.0; }
  /// Where the middle of the band is along its way, m from W's origin.
  double place(Time time) const;
  /// Share of the lamps' light that the band takes at a point of the table.
  double taken(const Vector2& p_W, Time time) const;
  /// Writes `rgb`, the encoded picture, to `shaded` as it is under the shadow.
  void cast(std::span<const std::uint8_t> rgb, Time time, std::span<std::uint8_t> shaded);

 private:
  static constexpr int kStep = 16;  ///< px
  /// A point of the table with what lamps have of its light.
  struct Node {
    Vector2 p_W{0.0, 0.0};
    std::array<float, 3> lamp_share{};
  };
  using Factor = std::array<std::uint32_t, 3>;  ///< encoded, kFull is 1
  static constexpr std::uint32_t kFull = 1U << 15U;

  void find_factors(Time time);

  MovingShadowSettings settings_;
  Vector2 along_;  ///< unit vector of its way
  double reach_;   ///< it turns back so far from W's origin, m
  double phase_;   ///< turns
  int width_, columns_;
  std::vector<Node> nodes_;
  std::vector<Factor> factors_;  ///< at the nodes
  std::vector<Factor> row_;      ///< between two rows of nodes
};

}  // namespace breakshot::sim_bridge
