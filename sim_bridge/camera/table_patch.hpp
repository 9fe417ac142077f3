#pragma once

#include "common/geometry.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/tile_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace breakshot::sim_bridge {

inline std::array<float, 2> to_float(const Vector2& v) { return {static_cast<float>(v.x()), static_cast<float>(v.y())}; }
inline std::array<float, 3> to_float(const Vector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}
inline std::array<float, 4> to_float(const Vector3& v, double w) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), static_cast<float>(w)};
}
/// Clip coordinates of a point of the table.
inline std::array<float, 4> clip_of(const Vector2& p_W, const Projector& projector) {
  const Eigen::Vector4f clip = projector.project({p_W.x(), p_W.y(), 0.0}).clip;
  return {clip.x(), clip.y(), clip.z(), clip.w()};
}

/// A quadrilateral as two triangles.
template <typename Vertex>
void append_quad(std::vector<Vertex>& vertices, const Vertex& a, const Vertex& b, const Vertex& c, const Vertex& d) {
  for (const Vertex* vertex : {&a, &b, &c, &a, &c, &d}) vertices.push_back(*vertex);
}

/// Parts per side of a rectangle, so that straight edges between them follow a lens that bends it: to 0.02 px for lenses with 40 px in the corners.
inline int cells_for(const Projector& projector, const Vector2& size) {
  constexpr double kBent = 0.012;  // m
  return projector.distorted() ? std::max(1, static_cast<int>(std::ceil(size.maxCoeff() / kBent))) : 1;
}

/// A rectangle of the table, in cells x cells parts.
struct TablePatch {
  Vector2 origin{0.0, 0.0};  ///< a corner, m
  Vector2 x_axis{1.0, 0.0};  ///< unit vector along the first side; the second is perpendicular to it, to the left
  Vector2 size{0.0, 0.0};    ///< m
  int cells = 1;             ///< per side

  Vector2 point(int column, int row) const {
    return origin + size.x() * column / cells * x_axis + size.y() * row / cells * perpendicular(x_axis);
  }

  /// Marks the tiles that it covers; all of them when a part of it is behind the camera, which then sees it at a grazing angle.
  void mark(const Projector& projector, TileGrid& tiles) const {
    Vector2 low = Vector2::Constant(1e9), high = Vector2::Constant(-1e9);
    for (int row = 0; row <= cells; ++row) {
      for (int column = 0; column <= cells; ++column) {
        const Vector2 p = point(column, row);
        const ProjectedPoint projected = projector.project({p.x(), p.y(), 0.0});
        if (!projected.in_front) {
          tiles.mark_all();
          return;
        }
        low = low.cwiseMin(projected.pixel);
        high = high.cwiseMax(projected.pixel);
      }
    }
    tiles.mark(low.x(), low.y(), high.x(), high.y());
  }

  /// Appends its triangles; make(p_W) makes the vertex at a point.
  template <typename Vertex, typename Make>
  void append_to(std::vector<Vertex>& vertices, Make&& make) const {
    for (int row = 0; row < cells; ++row) {
      for (int column = 0; column < cells; ++column) {
        append_quad(vertices, Vertex{make(point(column, row))}, Vertex{make(point(column + 1, row))},
                    Vertex{make(point(column + 1, row + 1))}, Vertex{make(point(column, row + 1))});
      }
    }
  }
};

}  // namespace breakshot::sim_bridge
