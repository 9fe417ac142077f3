#pragma once

#include "common/camera_model.hpp"
#include "common/geometry.hpp"

#include <cmath>

namespace breakshot::perception {

/// How upright discs look to the camera.
///
/// A disc is a cylinder between the table (z = 0) and its top face (z = h). Seen from above, its silhouette is bounded by the top rim where
/// the wall faces away from the camera, and by the base rim where the wall shows. Both rims are the same circle in W, each on its own
/// plane, so an outline point corrected with the right plane lies on one circle, and the parallax of the height is gone.
struct View {
  CameraModel camera;
  double disc_height = 0.0;  ///< h, m

  View(const CameraModel& camera_in, double disc_height_in)
      : camera{camera_in},
        disc_height{disc_height_in},
        foot_{camera_in.X_WC.translation().head<2>()},
        // Similar triangles between the camera's centre, the top plane and the table.
        shrink_{(camera_in.X_WC.translation().z() - disc_height_in) / camera_in.X_WC.translation().z()} {}

  /// Whether the silhouette of a disc at p_WD is bounded by its top rim in direction n_W (outward unit vector); else by its base rim.
  bool top_rim_bounds(const Vector2& p_WD, double radius, const Vector2& n_W) const noexcept {
    return (p_WD - foot_).dot(n_W) + radius > 0.0;
  }
  /// Width of the wall that the camera sees between the two rims in direction n_W, on the plane of the top faces, m.
  double wall_width(const Vector2& p_WD, double radius, const Vector2& n_W) const noexcept {
    return (1.0 - shrink_) * std::abs((p_WD - foot_).dot(n_W) + radius);
  }
  /// Where on the table the camera stands.
  const Vector2& foot() const noexcept { return foot_; }
  double rim_height(bool top_rim) const noexcept { return top_rim ? disc_height : 0.0; }

  /// Where the ray that meets the table in p_base passes the plane of the top faces, and the other way round.
  Vector2 top_of_ray(const Vector2& p_base) const noexcept { return foot_ + shrink_ * (p_base - foot_); }
  Vector2 base_of_ray(const Vector2& p_top) const noexcept { return foot_ + (p_top - foot_) / shrink_; }

 private:
  Vector2 foot_;   // of the camera on the table
  double shrink_;  // of the table's plane as seen on the top faces' plane
};

}  // namespace breakshot::perception
