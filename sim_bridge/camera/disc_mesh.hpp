#pragma once

#include "common/geometry.hpp"
#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/shadow.hpp"
#include "sim_bridge/camera/tile_grid.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <array>
#include <functional>
#include <vector>

namespace breakshot::sim_bridge {

/// What the vertex shader of discs takes; see shaders.hpp.
struct DiscVertex {
  std::array<float, 4> clip;
  std::array<float, 2> p_W;   ///< on the table
  std::array<float, 4> disc;  ///< centre, radius, height
  Rgb paint;                  ///< encoded
  Visibility visible;         ///< share of each lamp's light that arrives
};

/// The discs of one frame: for each a rectangle of the table behind which the camera sees it. The fragment shader finds where the ray
/// through a sample meets the cylinder, so outlines are exact and a disc is two triangles. (As a mesh it takes 200 slivers, and llvmpipe
/// shades each in blocks of 4 x 4: eight times the time.)
class DiscMesh {
 public:
  /// What arrives of the lamps at a point of W. Empty: all of it.
  using VisibilityAt = std::function<Visibility(const Vector3&)>;

  void clear() { vertices_.clear(); }
  /// Adds a disc, which must be lower than the camera, and marks the tiles that it covers.
  void add(const DiscState& disc, const Rgb& rgb, const Projector& projector, const VisibilityAt& visibility, TileGrid& tiles);

  const std::vector<DiscVertex>& vertices() const { return vertices_; }

 private:
  std::vector<DiscVertex> vertices_;
};

}  // namespace breakshot::sim_bridge
