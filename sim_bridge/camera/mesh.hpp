#pragma once

#include "common/geometry.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace breakshot::sim_bridge {

/// Triangles of one solid in its own frame, with outward normals. Counter-clockwise seen from outside.
struct Solid {
  struct Vertex {
    Vector3 p{0.0, 0.0, 0.0};
    Vector3 normal{0.0, 0.0, 1.0};
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
};

/// Long solids are cut into pieces, so that a diagonal link marks the tiles that it crosses and not its bounding box; m. Shorter ones under a lens that
/// bends their edges.
inline constexpr double kPiece = 0.10, kPieceDistorted = 0.03;
inline double piece_for(const Projector& projector) { return projector.distorted() ? kPieceDistorted : kPiece; }

/// A primitive of the arm, finely enough divided for smooth outlines and tight bounds in the image.
Solid make_solid(const Shape& shape, double piece = kPiece);

/// What the vertex shaders of arm and table take; see shaders.hpp.
struct SceneVertex {
  std::array<float, 4> clip;
  std::array<float, 3> p_W;
  std::array<float, 3> normal_W;
  std::array<float, 3> albedo;  ///< linear light
};

/// The triangles of one kind in one frame, projected. Cleared and refilled without giving memory back, so a steady scene allocates nothing.
class SceneMesh {
 public:
  void clear();

  /// Adds a solid at X_WS and marks the tiles that it covers.
  void add(const Solid& solid, const Pose& X_WS, const Rgb& rgb, const Projector& projector, TileGrid& tiles);

  const std::vector<SceneVertex>& vertices() const { return vertices_; }
  const std::vector<std::uint32_t>& indices() const { return indices_; }

 private:
  void mark_tiles(std::size_t first_index, std::size_t first_vertex, TileGrid& tiles) const;

  std::vector<SceneVertex> vertices_;
  std::vector<std::uint32_t> indices_;
  std::vector<ProjectedPoint> projected_;  ///< of the solid being added
};

/// Encoded colour to linear light. The exponent 2 is close to sRGB's 2.2, and undoing it is one square root where 2.2 takes a power, which costs
/// llvmpipe more than all the rest of the shading.
std::array<float, 3> linear(const Rgb& rgb);
inline constexpr double kGamma = 2.0;

}  // namespace breakshot::sim_bridge
