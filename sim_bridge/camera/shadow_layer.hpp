#pragma once

#include "sim_bridge/camera/gl_objects.hpp"
#include "sim_bridge/camera/light.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace breakshot::sim_bridge {

/// Draws shadows: for each pixel the factor by which the table darkens there.
///
/// The arm is high over the table, so its shadow is soft; it is drawn at a quarter of the resolution and enlarged. All members need the context in
/// which the object was made to be current.
class ShadowLayer {
 public:
  ShadowLayer(const Projector& projector, const Light& light, const TableSettings& table);

  /// Values per pixel of factors(): 1, or 4 (red, green, blue, nothing) when light is coloured.
  std::size_t channels() const { return channels_; }

  /// Makes factors() true in `tiles`, which must hold all tiles of `shadows`.
  void draw(const ShadowMesh& shadows, const TileGrid& tiles);
  /// Encoded, 255: no shadow; channels() per pixel, row by row.
  const std::vector<std::uint8_t>& factors() const { return factors_; }

 private:
  void draw_arm(const ShadowMesh& shadows);
  void draw_arm(const ShadowMesh& shadows, std::size_t lamp);
  template <std::size_t kChannels>
  void enlarge(const PixelRect& run);
  void draw_discs(const ShadowMesh& shadows);

  std::size_t channels_;
  GLenum format_;  ///< of what GL hands out
  int width_, height_;
  int coarse_width_, coarse_height_;
  Program arm_program_, disc_program_;
  VertexStream arm_stream_, disc_stream_;
  Target coarse_target_, target_;
  std::vector<std::uint8_t> coarse_;       ///< the arm's factors at a quarter of the resolution
  std::vector<std::uint8_t> coarse_lamp_;  ///< those of one lamp of several
  std::vector<float> coarse_loss_;         ///< light that is lost, summed over the lamps
  std::vector<std::uint16_t> coarse_row_;  ///< scratch of enlarge()
  std::vector<std::uint8_t> run_factors_;  ///< one run of tiles of the discs' factors
  std::vector<std::uint8_t> factors_;
};

}  // namespace breakshot::sim_bridge
