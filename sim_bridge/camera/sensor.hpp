#pragma once

#include "sim_bridge/camera/camera_settings.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace breakshot::sim_bridge {

/// What happens between the light and the numbers: exposure, then noise. Knows nothing of GL.
///
/// Noise comes from a table of 2^17 normal deviates that each block of 240 values reads from its own place, drawn by a counter-based hash of
/// (seed, frame, stream, block). So a frame's noise depends on nothing but seed and number, costs one load per value (generating normal
/// deviates would cost ten times that), and a value's noise is as good as independent of its neighbours' and of the frames before:
/// two blocks meet the same deviates in the same places with probability 2^-17.
class Sensor {
 public:
  /// Values that read consecutive deviates. A multiple of 3, so that every block begins with red, and of 16, so that vector loops fill it.
  static constexpr std::size_t kBlock = 240;

  /// Factors of one block of colour, fixed-point, one per value although most are equal: GCC multiplies 16-bit numbers as such
  /// only when both come from memory, which made expose() nearly three times faster.
  struct BlockCoefficients {
    std::array<std::uint16_t, kBlock> gain{};         ///< r g b r g b ...
    std::array<std::uint16_t, kBlock> sigma_start{};  ///< the curve of colour_sigma
    std::array<std::uint16_t, kBlock> sigma_slope{};
    std::array<std::uint16_t, kBlock> sigma_bow{};
  };

  /// @throws CameraError when a setting is out of its range
  Sensor(const NoiseSettings& noise, std::uint64_t seed, double depth_min, double depth_max);

  /// @throws CameraError when a factor is outside 0 to kMaxBrightness
  void set_exposure(const Exposure& exposure);

  /// Colour of a frame: `ideal` under the exposure, with noise, rounded and clipped to 0 to 255. Both 3 bytes per pixel, row by row.
  void expose(std::span<const std::uint8_t> ideal, std::uint64_t frame, std::span<std::uint8_t> rgb);
  /// Depth of a frame, 0.1 mm; 0 (none) stays 0, and becomes what leaves the range of the camera.
  void measure(std::span<const std::uint16_t> ideal, std::uint64_t frame, std::span<std::uint16_t> depth) const;

  /// Standard deviation of a colour value that the sensor adds, for tests and documents: the fixed-point curve, not the formula.
  double colour_sigma(int value) const;

 private:
  std::size_t block_offset(std::uint64_t frame, std::uint64_t stream, std::size_t block) const noexcept;

  NoiseSettings noise_;
  std::uint64_t seed_;
  std::int32_t depth_low_, depth_high_;  ///< range of the camera, 0.1 mm
  float depth_scale_;                    ///< noise of the depth: sigma = depth_scale_ * z^2 with z in 0.1 mm
  std::vector<std::int16_t> deviates_;
  BlockCoefficients block_;
};

}  // namespace breakshot::sim_bridge
