#pragma once

#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/disc_mesh.hpp"
#include "sim_bridge/camera/gl_objects.hpp"
#include "sim_bridge/camera/mesh.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/camera/shadow_layer.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
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
  Scene(const Projector& projector, std::size_t lamps)
      : shadows{projector, lamps}, solid_tiles{projector.model().width, projector.model().height}, disc_tiles{solid_tiles} {}
  void clear() {
    table.clear();
    arm.clear();
    discs.clear();
    shadows.clear();
    solid_tiles.clear();
    disc_tiles.clear();
  }

  /// Everything that it touches.
  TileGrid tiles() const {
    TileGrid all = solid_tiles;
    all.mark(disc_tiles);
    all.mark(shadows.arm_tiles());
    all.mark(shadows.disc_tiles());
    return all;
  }

  SceneMesh table, arm;
  DiscMesh discs;
  ShadowMesh shadows;
  TileGrid solid_tiles;  ///< touched by table or arm
  TileGrid disc_tiles;
};

/// Draws scenes with OpenGL ES 3.0 and composes them over a background.
///
/// Anti-aliasing: the scene is drawn four times, each time a different quarter of a pixel aside (a rotated grid, so that upright and level
/// edges have four levels too), and averaged on the CPU. On llvmpipe this costs half of 4x multisampling, whose resolve alone takes 25 ns per
/// pixel there, and needs nothing beyond ES 3.0. Tiles that the arm fills have no outlines and are drawn once only. Shadows on the table are
/// soft, so they are drawn once, as factors, and the arm's at a quarter of the resolution.
///
/// All members need the context in which the object was made to be current.
class Rasteriser {
 public:
  Rasteriser(const Projector& projector, const Light& light, const ShineSettings& shine, const TableSettings& table);

  /// Draws over `background` and writes the tiles that the scene touches to `image`; leaves the rest of `image` alone.
  void draw(const Scene& scene, const IdealImage& background, IdealImage& image);
  /// The same with one sample per pixel, the `sample`-th of the pattern, and within the tiles of `mask` only: one of many pictures to be averaged.
  void draw_sample(const Scene& scene, std::size_t sample, const TileGrid& mask, const IdealImage& background, IdealImage& image);

 private:
  Rasteriser(const Projector& projector, const Light& light, const ShineSettings& shine, const TableSettings& table,
             const std::string& definitions);

  /// A program with what it draws.
  struct Pass {
    Program program;
    VertexStream stream;
    GLint jitter;
  };

  void begin(const Scene& scene, const TileGrid* mask);
  void finish(const IdealImage& background, IdealImage& image);
  void draw_layer(const Scene& scene, std::size_t layer);
  void draw_quads(const TileGrid& tiles, float depth);
  void add_layer(const TileGrid& tiles);
  void find_filled(const Scene& scene);
  void let_one_layer_stand_for_all(const PixelRect& rect);
  /// Puts the layers over the background that the shadows darken. kChannels: of ShadowLayer::factors().
  template <std::size_t kChannels>
  void compose(const IdealImage& background, IdealImage& image) const;
  template <std::size_t kChannels>
  void compose_mesh(const PixelRect& run, const IdealImage& background, IdealImage& image) const;
  template <std::size_t kChannels>
  void compose_shadow(const PixelRect& run, const IdealImage& background, IdealImage& image) const;

  int width_, height_;
  Pass table_, arm_, discs_, clear_;
  ShadowLayer shadow_layer_;
  Target target_;

  // Of the frame being drawn:
  TileGrid mesh_tiles_, shadow_tiles_, all_tiles_;
  TileGrid filled_;    ///< tiles that the arm fills
  TileGrid outlined_;  ///< the other tiles of mesh_tiles_
  std::vector<std::array<float, 3>> quads_;
  std::vector<std::uint8_t> run_rgba_;  ///< one run of tiles of one layer
  std::vector<std::uint16_t> run_depth_;
  std::vector<std::uint16_t> sum_rgba_;  ///< of the layers; alpha counts layers that show the background, times 255
  std::vector<std::uint32_t> sum_depth_;
};

}  // namespace breakshot::sim_bridge
