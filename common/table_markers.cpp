#include "common/table_markers.hpp"

namespace breakshot {

std::array<Vector2, 4> corners_of(const TableMarker& marker, double side) noexcept {
  const Eigen::Rotation2Dd turn{marker.yaw};
  const double half = 0.5 * side;
  return {marker.p_WM + turn * Vector2{-half, half}, marker.p_WM + turn * Vector2{half, half}, marker.p_WM + turn * Vector2{half, -half},
          marker.p_WM + turn * Vector2{-half, -half}};
}

}  // namespace breakshot
