#include "sim_bridge/camera/disc_mesh.hpp"

#include "sim_bridge/camera/table_patch.hpp"

#include <algorithm>

namespace breakshot::sim_bridge {
namespace {

/// Cells per side of the rectangle, at least, for a shadow that is interpolated between its corners.
constexpr int kCellsShaded = 3;

}  // namespace

void DiscMesh::add(const DiscState& disc, const Rgb& rgb, const Projector& projector, const VisibilityAt& visibility, TileGrid& tiles) {
  // Seen from the camera the top hides a larger circle of the table, farther out; what is hidden is the hull of it and the foot.
  const Vector3 p_WC = projector.model().X_WC.translation();
  const double stretch = p_WC.z() / (p_WC.z() - disc.height);
  const Vector2 shift = (stretch - 1.0) * (disc.p_WD - p_WC.head<2>());
  const double top_radius = stretch * disc.radius;
  TablePatch patch;
  patch.x_axis = shift.norm() > 1e-9 ? Vector2{shift.normalized()} : Vector2{Vector2::UnitX()};
  const double back = std::max(disc.radius, top_radius - shift.norm());  // a disc below the camera is all top
  patch.origin = disc.p_WD - back * patch.x_axis - top_radius * perpendicular(patch.x_axis);
  patch.size = {back + shift.norm() + top_radius, 2.0 * top_radius};
  patch.cells = std::max(cells_for(projector, patch.size), visibility ? kCellsShaded : 1);
  patch.mark(projector, tiles);

  const std::array<float, 4> parameters{static_cast<float>(disc.p_WD.x()), static_cast<float>(disc.p_WD.y()),
                                        static_cast<float>(disc.radius), static_cast<float>(disc.height)};
  patch.append_to(vertices_, [&](const Vector2& p) {
    DiscVertex vertex{clip_of(p, projector), to_float(p), parameters, rgb, {1.0F, 1.0F, 1.0F, 1.0F}};
    if (visibility) {
      const Vector2 p_top = p_WC.head<2>() + (p - p_WC.head<2>()) / stretch;  // what is seen there: mostly the top
      vertex.visible = visibility({p_top.x(), p_top.y(), disc.height});
    }
    return vertex;
  });
}

}  // namespace breakshot::sim_bridge
