#include "sim_bridge/camera/mesh.hpp"

#include "sim_bridge/camera/table_patch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::sim_bridge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kSegments = 28;
int pieces(double length, double piece) { return std::max(1, static_cast<int>(std::ceil(length / piece))); }

/// The corner radius at which a regular polygon has the area of the unit circle.
double equal_area_radius() {
  const double angle = kTwoPi / kSegments;
  return std::sqrt(angle / std::sin(angle));
}

/// Two triangles for each cell of a (rows + 1) x (columns + 1) lattice of vertices that begins at `first`.
void stitch(Solid& solid, std::uint32_t first, int rows, int columns) {
  const auto at = [&](int row, int column) { return first + static_cast<std::uint32_t>(row * (columns + 1) + column); };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const auto a = at(row, column), b = at(row, column + 1), c = at(row + 1, column + 1), d = at(row + 1, column);
      solid.indices.insert(solid.indices.end(), {a, b, c, a, c, d});
    }
  }
}

/// A round cap in the plane z, facing up (side = 1) or down (side = -1).
void add_cap(Solid& solid, double radius, double z, double side) {
  const auto first = static_cast<std::uint32_t>(solid.vertices.size());
  const Vector3 normal{0.0, 0.0, side};
  solid.vertices.push_back({{0.0, 0.0, z}, normal});
  for (int i = 0; i < kSegments; ++i) {
    const double angle = side * kTwoPi * i / kSegments;
    solid.vertices.push_back({{radius * std::cos(angle), radius * std::sin(angle), z}, normal});
  }
  for (std::uint32_t i = 0; i < kSegments; ++i)
    solid.indices.insert(solid.indices.end(), {first, first + 1 + i, first + 1 + (i + 1) % kSegments});
}

/// The side of a cylinder around z from z_low to z_high.
void add_wall(Solid& solid, double radius, double z_low, double z_high, int rows) {
  const auto first = static_cast<std::uint32_t>(solid.vertices.size());
  for (int row = 0; row <= rows; ++row) {
    const double z = z_low + (z_high - z_low) * row / rows;
    for (int i = 0; i <= kSegments; ++i) {
      const double angle = kTwoPi * i / kSegments;
      const Vector3 outward{std::cos(angle), std::sin(angle), 0.0};
      solid.vertices.push_back({radius * outward + z * Vector3::UnitZ(), outward});
    }
  }
  stitch(solid, first, rows, kSegments);
}

void add_sphere(Solid& solid, double radius) {
  constexpr int kRows = kSegments / 2;
  const auto first = static_cast<std::uint32_t>(solid.vertices.size());
  for (int row = 0; row <= kRows; ++row) {
    const double latitude = std::numbers::pi * (static_cast<double>(row) / kRows - 0.5);
    for (int i = 0; i <= kSegments; ++i) {
      const double angle = kTwoPi * i / kSegments;
      const Vector3 outward{std::cos(latitude) * std::cos(angle), std::cos(latitude) * std::sin(angle), std::sin(latitude)};
      solid.vertices.push_back({radius * outward, outward});
    }
  }
  stitch(solid, first, kRows, kSegments);
}

/// One face of a box: `normal` is half an edge long and points to the face's centre; u x v points along it.
void add_face(Solid& solid, const Vector3& centre, const Vector3& u, const Vector3& v, double piece) {
  const auto first = static_cast<std::uint32_t>(solid.vertices.size());
  const int columns = pieces(2.0 * u.norm(), piece), rows = pieces(2.0 * v.norm(), piece);
  const Vector3 normal = u.cross(v).normalized();
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      solid.vertices.push_back({centre + (2.0 * column / columns - 1.0) * u + (2.0 * row / rows - 1.0) * v, normal});
    }
  }
  stitch(solid, first, rows, columns);
}

void add_box(Solid& solid, const Vector3& size, double piece) {
  const Vector3 half = 0.5 * size;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 n = half[axis] * Vector3::Unit(axis);
    const Vector3 u = half[(axis + 1) % 3] * Vector3::Unit((axis + 1) % 3);
    const Vector3 v = half[(axis + 2) % 3] * Vector3::Unit((axis + 2) % 3);
    add_face(solid, n, u, v, piece);
    add_face(solid, -n, v, u, piece);
  }
}

}  // namespace

Solid make_solid(const Shape& shape, double piece) {
  Solid solid;
  switch (shape.kind) {
    case Shape::Kind::kBox: add_box(solid, shape.size, piece); break;
    case Shape::Kind::kCylinder: {
      const double radius = shape.size.x() * equal_area_radius(), half = 0.5 * shape.size.y();
      add_cap(solid, radius, half, 1.0);
      add_cap(solid, radius, -half, -1.0);
      add_wall(solid, radius, -half, half, pieces(shape.size.y(), piece));
      break;
    }
    case Shape::Kind::kSphere: add_sphere(solid, shape.size.x()); break;
  }
  return solid;
}

void SceneMesh::clear() {
  vertices_.clear();
  indices_.clear();
}

void SceneMesh::add(const Solid& solid, const Pose& X_WS, const Rgb& rgb, const Projector& projector, TileGrid& tiles) {
  const std::size_t first_vertex = vertices_.size(), first_index = indices_.size();
  const std::array<float, 3> albedo = linear(rgb);
  projected_.clear();
  for (const Solid::Vertex& vertex : solid.vertices) {
    const Vector3 p_W = X_WS * vertex.p;
    const ProjectedPoint projected = projector.project(p_W);
    projected_.push_back(projected);
    vertices_.push_back({{projected.clip.x(), projected.clip.y(), projected.clip.z(), projected.clip.w()},
                         to_float(p_W),
                         to_float(Vector3{X_WS.linear() * vertex.normal}),
                         albedo});
  }
  for (const std::uint32_t index : solid.indices) indices_.push_back(static_cast<std::uint32_t>(first_vertex) + index);
  mark_tiles(first_index, first_vertex, tiles);
}

void SceneMesh::mark_tiles(std::size_t first_index, std::size_t first_vertex, TileGrid& tiles) const {
  for (std::size_t i = first_index; i < indices_.size(); i += 3) {
    const ProjectedPoint& a = projected_[indices_[i] - first_vertex];
    const ProjectedPoint& b = projected_[indices_[i + 1] - first_vertex];
    const ProjectedPoint& c = projected_[indices_[i + 2] - first_vertex];
    if (!a.in_front && !b.in_front && !c.in_front) continue;
    if (!a.in_front || !b.in_front || !c.in_front) {
      tiles.mark_all();  // cut by the near plane: an arm at the lens covers the image anyway
      return;
    }
    const Vector2 low = a.pixel.cwiseMin(b.pixel).cwiseMin(c.pixel), high = a.pixel.cwiseMax(b.pixel).cwiseMax(c.pixel);
    tiles.mark(low.x(), low.y(), high.x(), high.y());
  }
}

std::array<float, 3> linear(const Rgb& rgb) {
  std::array<float, 3> result{};
  std::transform(rgb.begin(), rgb.end(), result.begin(),
                 [](float encoded) { return static_cast<float>(std::pow(static_cast<double>(encoded), kGamma)); });
  return result;
}

}  // namespace breakshot::sim_bridge
