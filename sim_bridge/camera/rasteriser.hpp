#pragma once

#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/disc_mesh.hpp"
#include "sim_bridge/camera/gl_objects.hpp"
#include "sim_bridge/camera/mesh.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <array>
#include <cstdint>
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

/// What one frame shows.
struct Scene {
  explicit Scene(const Projector& projector) : shadows{projector}, mesh_tiles{projector.model().width, projector.model().height} {}
  void clear() {
    table.clear();
    arm.clear();
    discs.clear();
    shadows.clear();
    mesh_tiles.clear();
  }

  SceneMesh table, arm;
  DiscMesh discs;
  ShadowMesh shadows;
  TileGrid mesh_tiles;  ///< touched by table, arm or discs
};

/// Draws scenes with OpenGL ES 3.0 and composes them over a background.
///
/// Anti-aliasing: the scene is drawn four times, each time a different quarter of a pixel aside (a rotated grid, so that upright and level
/// edges have four levels too), and averaged on the CPU. On llvmpipe this costs half of 4x multisampling, whose resolve alone takes 25 ns per
/// pixel there, and needs nothing beyond ES 3.0. Shadows on the table are soft, so they are drawn once, as factors, and the arm's at
/// half the resolution.
///
/// All members need the context in which the object was made to be current.
class Rasteriser {
 public:
  Rasteriser(const Projector& projector, const Light& light, const TableSettings& table);

  /// Draws over `background` and writes the tiles that the scene touches to `image`; leaves the rest of `image` alone.
  void draw(const Scene& scene, const IdealImage& background, IdealImage& image);

 private:
  /// A program with what it draws.
  struct Pass {
    Program program;
    VertexStream stream;
    GLint jitter;
  };

  void fill_quads(const TileGrid& tiles);
  void draw_shadows(const ShadowMesh& shadows);
  void draw_layer(const Scene& scene, std::size_t layer);
  void add_layer(const TileGrid& tiles);
  void compose_mesh(const PixelRect& run, const IdealImage& background, IdealImage& image) const;
  void compose_shadow(const PixelRect& run, const IdealImage& background, IdealImage& image) const;

  int width_, height_;
  Pass table_, arm_, discs_, clear_, arm_shadow_, enlarge_, disc_shadows_;
  Target layer_target_, half_target_, shadow_target_;
  TileGrid all_tiles_, shadow_tiles_;        ///< that the frame being drawn touches
  std::vector<std::array<float, 2>> quads_;  ///< corners of tiles
  std::vector<std::uint8_t> run_rgba_;       ///< one run of tiles of one layer
  std::vector<std::uint16_t> run_depth_;
  std::vector<std::uint16_t> sum_rgba_;  ///< of the layers
  std::vector<std::uint32_t> sum_depth_;
  std::vector<std::uint8_t> shadow_factor_;
};

}  // namespace breakshot::sim_bridge
