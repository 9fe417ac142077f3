#pragma once

#include "common/camera_model.hpp"
#include "common/geometry.hpp"

namespace breakshot::sim_bridge {

/// A point on its way to the screen.
struct ProjectedPoint {
  Vector2 pixel{0.0, 0.0};                       ///< as CameraModel::project says; only when in_front
  Eigen::Vector4f clip{0.0F, 0.0F, 0.0F, 1.0F};  ///< GL clip coordinates; image row 0 at y = -1, w = depth along the optical axis
  bool in_front = false;                         ///< beyond the near plane
};

/// Turns points of W into GL's clip coordinates so that a pixel centre of CameraModel is a pixel centre of the rasteriser.
///
/// Projecting on the CPU, in double precision and with the very model that perception uses, makes agreement (distortion included) a matter of
/// construction. A frame has a few thousand vertices, which is 0.1 ms.
class Projector {
 public:
  static constexpr double kNear = 0.02;  ///< m

  /// @throws CameraError when the distortion folds the image over itself (is no lens), or an intrinsic parameter is absurd
  explicit Projector(const CameraModel& model);

  ProjectedPoint project(const Vector3& p_W) const;
  /// Where the ray through a pixel meets z = 0 of W.
  Vector2 table_point(const Vector2& pixel) const { return model_.point_on_plane(pixel, 0.0); }
  bool distorted() const { return distorted_; }
  const CameraModel& model() const { return model_; }

 private:
  CameraModel model_;
  Pose X_CW_;
  bool distorted_;
  double tan_limit_;  ///< beyond this tangent from the optical axis (well outside the image) points are projected without distortion
};

}  // namespace breakshot::sim_bridge
