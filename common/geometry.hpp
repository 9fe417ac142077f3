#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace breakshot {

// Frames, in the monogram notation of this project: W world (origin on the table top in the middle of the workspace, z up), B arm base,
// T striker tip (centre of the rod's lower face, z pointing down along the rod), C camera (optical: z forward, x right, y down), D disc.

/// A point or a free vector in the table plane. Metres unless the name says otherwise.
using Vector2 = Eigen::Vector2d;
using Matrix2 = Eigen::Matrix2d;
using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
/// A rigid pose X_AB: maps coordinates in B to coordinates in A.
using Pose = Eigen::Isometry3d;

/// A closed, axis-aligned rectangle of the table plane, in W, m.
struct Rect {
  Vector2 min{0.0, 0.0};
  Vector2 max{0.0, 0.0};

  bool contains(const Vector2& p) const noexcept { return (p.array() >= min.array()).all() && (p.array() <= max.array()).all(); }
  /// Distance from p to the nearest side, m; positive inside, negative outside (then minus the distance to the rectangle).
  double margin(const Vector2& p) const noexcept {
    const Vector2 inside = (p - min).cwiseMin(max - p);
    if (inside.minCoeff() >= 0.0) return inside.minCoeff();
    return -(-inside).cwiseMax(0.0).norm();
  }
  Rect grown(double by) const noexcept { return {min - Vector2::Constant(by), max + Vector2::Constant(by)}; }
};

/// v turned by +90 degrees.
inline Vector2 perpendicular(const Vector2& v) noexcept { return {-v.y(), v.x()}; }

inline constexpr double kGravity = 9.80665;  ///< m/s^2, standard gravity (ISO 80000-3)

}  // namespace breakshot
