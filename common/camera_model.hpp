#pragma once

#include "common/geometry.hpp"

#include <array>
#include <optional>

namespace breakshot {

/// A calibrated pinhole camera with Brown-Conrady distortion (OpenCV's order k1 k2 p1 p2 k3). C is the optical frame: z forward, x right, y down.
struct CameraModel {
  int width = 1280;
  int height = 720;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< px; pixel centres are at integer coordinates
  std::array<double, 5> distortion{};
  Pose X_WC{Pose::Identity()};

  /// Pixel of a point of W; nothing when it lies behind the camera. May lie outside the image.
  std::optional<Vector2> project(const Vector3& p_W) const noexcept;
  /// Where the ray through a pixel meets the horizontal plane z = height_W (undistorts by fixed-point iteration; error < 1e-6 px for the
  /// distortions of real lenses). The ray must point down; a camera that looks up is refused when the configuration is loaded.
  Vector2 point_on_plane(const Vector2& pixel, double height_W) const noexcept;
};

}  // namespace breakshot
