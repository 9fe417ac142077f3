#include "sim_bridge/camera/marker_mesh.hpp"

namespace breakshot::sim_bridge {
namespace {

/// Of the print, m: the depth buffer tells it from the table below, and in the image it shifts nothing (0.03 px at the edge).
constexpr double kThickness = 50e-6;
constexpr Rgb kWhite{0.93F, 0.93F, 0.92F}, kBlack{0.09F, 0.09F, 0.09F};

}  // namespace

void add_marker(const MarkerPrint& marker, const Projector& projector, SceneMesh& table, TileGrid& tiles) {
  Shape shape;
  shape.kind = Shape::Kind::kBox;
  shape.size = {marker.square, marker.square, kThickness};
  const Solid square = make_solid(shape);
  Pose X_WM{Pose::Identity()};
  X_WM.translation() << marker.p_WM, 0.5 * kThickness;
  X_WM.rotate(Eigen::AngleAxisd{marker.yaw, Vector3::UnitZ()});
  const double first = 0.5 * (marker.squares - 1) * marker.square;
  for (int row = 0; row < marker.squares; ++row) {
    for (int column = 0; column < marker.squares; ++column) {
      const Vector3 p_M{column * marker.square - first, first - row * marker.square, 0.0};
      const bool white = marker.white[pixel_index(column, row, marker.squares)];
      table.add(square, X_WM * Eigen::Translation3d{p_M}, white ? kWhite : kBlack, projector, tiles);
    }
  }
}

}  // namespace breakshot::sim_bridge
