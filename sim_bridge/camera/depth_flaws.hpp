#pragma once

#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace breakshot::sim_bridge {

/// What a stereo camera gets wrong where depth jumps; noise is Sensor's.
///
/// - **Shadow**: a place that something nearer hides from the second camera of the pair, which stands to the right, has no depth. That is a band to the left
///   of whatever stands up, as wide as the disparities differ: focal length * baseline * (1 / z_near - 1 / z_far), in pixels of the colour image.
/// - **Bleed**: block matching lets the nearer surface reach out over the rim, raggedly.
/// - **Holes**: at the rim the match fails here and there.
///
/// Ragged in blocks of kBlock pixels, drawn by a hash of (seed, frame, block).
class DepthFlaws {
 public:
  static constexpr int kBlock = 4;  ///< px

  /// @param focal  of the image that depth is registered to, px
  /// @throws CameraError when a setting is out of its range
  DepthFlaws(const DepthFlawSettings& settings, double focal, double baseline, std::uint64_t seed);

  bool active() const { return settings_.shadow || settings_.holes > 0.0 || settings_.bleed > 0.0; }
  /// Writes `ideal` to `flawed` with its flaws, 0.1 mm.
  /// @param raised  the tiles where something stands up from the table
  void apply(std::span<const std::uint16_t> ideal, int width, const TileGrid& raised, std::uint64_t frame, std::span<std::uint16_t> flawed);

 private:
  /// In [0, 1), for one use of a block.
  double draw(int x, int y, std::uint64_t frame, std::uint64_t use) const;
  void roughen(std::span<const std::uint16_t> ideal, int width, const PixelRect& run, std::uint64_t frame, std::span<std::uint16_t> flawed);
  void shade_row(std::span<std::uint16_t> row, int end);

  DepthFlawSettings settings_;
  std::uint64_t seed_;
  std::vector<float> disparity_;        ///< px, by depth in 0.1 mm
  std::vector<std::uint16_t> nearest_;  ///< scratch: smallest depth in a row's window, of the rows around a run
};

}  // namespace breakshot::sim_bridge
