#pragma once

#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/gl_objects.hpp"
#include "sim_bridge/camera/mesh.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace breakshot::sim_bridge {

/// Colour and depth before the sensor: 3 bytes and one value of 0.1 mm (0: nothing) per pixel, row by row.
struct IdealImage {
  IdealImage(int width, int height)
      : rgb(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
        depth(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}
  std::vector<std::uint8_t> rgb;
  std::vector<std::uint16_t> depth;
};

/// Draws meshes with OpenGL ES 3.0 and composes them over a background.
///
/// Anti-aliasing: the scene is drawn four times, each time a different quarter of a pixel aside (a rotated grid, so that upright and level edges
/// have four levels too), and averaged on the CPU. On llvmpipe this costs half of 4x multisampling, whose resolve alone takes
/// 25 ns per pixel there, and needs nothing beyond ES 3.0. Shadows on the table are soft, so they are drawn once, as factors.
///
/// All members need the context in which the object was made to be current.
class Rasteriser {
 public:
  static constexpr int kLayers = 4;

  Rasteriser(const Projector& projector, const Light& light, const TableSettings& table);

  /// Draws over `background` and writes the tiles that are marked in either grid to `image`; leaves the rest of `image` alone.
  void draw(std::span<const SceneMesh> meshes, const TileGrid& mesh_tiles, const ShadowMesh& shadows, const TileGrid& shadow_tiles,
            const IdealImage& background, IdealImage& image);

 private:
  void draw_layers(std::span<const SceneMesh> meshes, const TileGrid& tiles);
  void draw_shadows(const ShadowMesh& shadows, const TileGrid& tiles);
  void compose_mesh(const PixelRect& run, const IdealImage& background, IdealImage& image) const;
  void compose_shadow(const PixelRect& run, const IdealImage& background, IdealImage& image) const;

  int width_, height_;
  std::array<Program, kSurfaces> surface_programs_;
  std::array<GLint, kSurfaces> jitter_locations_;
  std::array<VertexStream, kSurfaces> surface_streams_;
  Program clear_program_, disc_shadow_program_, arm_shadow_program_;
  VertexStream clear_stream_, disc_shadow_stream_, arm_shadow_stream_;
  Target layers_target_, shadow_target_;
  std::vector<float> clear_quads_;
  std::vector<std::uint8_t> layer_rgba_;  ///< kLayers images, one after the other
  std::vector<std::uint16_t> layer_depth_;
  std::vector<std::uint8_t> shadow_factor_;
  TileGrid all_tiles_;
};

}  // namespace breakshot::sim_bridge
