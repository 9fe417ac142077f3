#include "sim_bridge/camera/projector.hpp"

#include "sim_bridge/camera/camera_settings.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace breakshot::sim_bridge {
namespace {

/// Largest image side. A 4 K image renders; beyond it the stack of anti-aliasing layers outgrows common GL texture limits.
constexpr int kMaxSide = 4096;

void check_intrinsics(const CameraModel& model) {
  if (model.width < 16 || model.width > kMaxSide || model.height < 16 || model.height > kMaxSide) {
    throw CameraError{"camera: image size " + std::to_string(model.width) + " x " + std::to_string(model.height) +
                      "; allowed 16 to 4096 px a side"};
  }
  const bool finite = std::isfinite(model.fx) && std::isfinite(model.fy) && std::isfinite(model.cx) && std::isfinite(model.cy) &&
                      std::all_of(model.distortion.begin(), model.distortion.end(), [](double k) { return std::isfinite(k); }) &&
                      model.X_WC.matrix().allFinite();
  if (!finite || model.fx <= 0.0 || model.fy <= 0.0) {
    throw CameraError{"camera: focal lengths must be finite and above 0, all other parameters finite"};
  }
}

}  // namespace

Projector::Projector(const CameraModel& model)
    : model_{model},
      X_CW_{model.X_WC.inverse()},
      distorted_{std::any_of(model.distortion.begin(), model.distortion.end(), [](double k) { return k != 0.0; })},
      tan_limit_{0.0} {
  check_intrinsics(model);
  const double tan_x = std::max(model.cx, model.width - 1.0 - model.cx) / model.fx;
  const double tan_y = std::max(model.cy, model.height - 1.0 - model.cy) / model.fy;
  // The factor leaves room for a lens that squeezes more of the world into the image than the pinhole would.
  tan_limit_ = 1.4 * std::hypot(tan_x, tan_y);
  if (!distorted_) return;

  // Brown-Conrady polynomials turn back at some radius; before tan_limit_ that would show things twice.
  constexpr int kSteps = 200;
  double last_radius = 0.0;
  const Vector2 centre{model.cx, model.cy};
  for (int i = 1; i <= kSteps; ++i) {
    const double tangent = tan_limit_ * i / kSteps;
    const Vector3 p_C{tangent * tan_x / std::hypot(tan_x, tan_y), tangent * tan_y / std::hypot(tan_x, tan_y), 1.0};
    const auto pixel = model.project(model.X_WC * p_C);
    const double radius = pixel ? (*pixel - centre).norm() : 0.0;
    if (!(radius > last_radius)) {
      throw CameraError{"camera: the lens distortion folds the image over itself at " +
                        std::to_string(std::atan(tangent) * 57.29577951308232) +
                        " degrees from the optical axis; allowed is a lens that does not up to " +
                        std::to_string(std::atan(tan_limit_) * 57.29577951308232) + " degrees"};
    }
    last_radius = radius;
  }
}

ProjectedPoint Projector::project(const Vector3& p_W) const {
  const Vector3 p_C = X_CW_ * p_W;
  ProjectedPoint result;
  result.in_front = p_C.z() >= kNear;

  // Homogeneous pixel coordinates: still meaningful behind the camera, where GL clips the triangle.
  Vector2 pixel_times_z{model_.fx * p_C.x() + model_.cx * p_C.z(), model_.fy * p_C.y() + model_.cy * p_C.z()};
  if (result.in_front) {
    if (distorted_ && p_C.head<2>().norm() < tan_limit_ * p_C.z()) {
      if (const auto pixel = model_.project(p_W)) pixel_times_z = *pixel * p_C.z();
    }
    result.pixel = pixel_times_z / p_C.z();
  }

  // Pixel centres are at integer coordinates in the model and at halves in GL. The far plane is at infinity.
  const double z = p_C.z();
  result.clip = Eigen::Vector4d{(2.0 * pixel_times_z.x() + z) / model_.width - z, (2.0 * pixel_times_z.y() + z) / model_.height - z,
                                z - 2.0 * kNear, z}
                    .cast<float>();
  return result;
}

}  // namespace breakshot::sim_bridge
