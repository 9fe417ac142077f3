#include "common/camera_model.hpp"

#include <cmath>

namespace breakshot {
namespace {

/// Brown-Conrady: where a ray of normalised image coordinates p is seen by the real lens (Brown 1971; OpenCV's order k1 k2 p1 p2 k3).
Vector2 distort(const Vector2& p, const std::array<double, 5>& k) noexcept {
  const double r2 = p.squaredNorm();
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double xy = p.x() * p.y();
  return {p.x() * radial + 2.0 * k[2] * xy + k[3] * (r2 + 2.0 * p.x() * p.x()),
          p.y() * radial + k[2] * (r2 + 2.0 * p.y() * p.y()) + 2.0 * k[3] * xy};
}

/// Inverse of distort() by fixed-point iteration: the distortion of a lens is small and smooth, so what it adds at the last guess is
/// nearly what it adds at the solution. Each round gains about two digits for the lenses that we know.
Vector2 undistort(const Vector2& seen, const std::array<double, 5>& k) noexcept {
  constexpr int kMaxRounds = 50;
  constexpr double kEnough = 1e-12;  // normalised; 1e-9 px at a focal length of 1000 px
  Vector2 p = seen;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Vector2 next = p + seen - distort(p, k);
    const bool settled = (next - p).lpNorm<Eigen::Infinity>() < kEnough;
    p = next;
    if (settled) break;
  }
  return p;
}

}  // namespace

std::optional<Vector2> CameraModel::project(const Vector3& p_W) const noexcept {
  const Vector3 p_C = X_WC.linear().transpose() * (p_W - X_WC.translation());
  if (!(p_C.z() > 0.0)) return std::nullopt;
  const Vector2 seen = distort(p_C.head<2>() / p_C.z(), distortion);
  return Vector2{fx * seen.x() + cx, fy * seen.y() + cy};
}

Vector2 CameraModel::point_on_plane(const Vector2& pixel, double height_W) const noexcept {
  const Vector2 ray = undistort({(pixel.x() - cx) / fx, (pixel.y() - cy) / fy}, distortion);
  const Vector3 direction_W = X_WC.linear() * ray.homogeneous();
  const double scale = (height_W - X_WC.translation().z()) / direction_W.z();
  return (X_WC.translation() + scale * direction_W).head<2>();
}

}  // namespace breakshot
