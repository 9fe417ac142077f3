#include "sim_bridge/camera/motion.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::sim_bridge {
namespace {

constexpr double kSpacing = 1.5;  // px between two pictures: steps of that are hardly seen after the average
constexpr std::size_t kPlaces = 4, kMostSamples = 16;
constexpr double kNearest = 0.05;  // m; what is nearer to the lens fills the picture anyway

double px_per_m(double height_W, const CameraModel& camera) {
  return camera.fx / std::max(camera.X_WC.translation().z() - height_W, kNearest);
}

}  // namespace

DiscState moved(DiscState disc, double seconds) {
  disc.p_WD += seconds * disc.v_WD_W;
  return disc;
}

Pose moved(const Pose& X_WL, const LinkVelocity& velocity, double seconds) {
  Pose result = X_WL;
  result.translation() += seconds * velocity.v_WL_W;
  const double speed = velocity.w_WL_W.norm();
  if (speed > 0.0) result.linear() = Eigen::AngleAxisd{seconds * speed, velocity.w_WL_W / speed}.toRotationMatrix() * X_WL.linear();
  return result;
}

double motion_px(const DiscState& disc, double seconds, const CameraModel& camera) {
  return disc.v_WD_W.norm() * seconds * px_per_m(disc.height, camera);
}

double motion_px(const Capsule& capsule_W, const Pose& X_WL, const LinkVelocity& velocity, double seconds, const CameraModel& camera) {
  const auto at = [&](const Vector3& p_W) {
    return (velocity.v_WL_W + velocity.w_WL_W.cross(p_W - X_WL.translation())).norm() * seconds *
           px_per_m(p_W.z() + capsule_W.radius, camera);
  };
  return std::max(at(capsule_W.start), at(capsule_W.end));
}

std::size_t samples_for(double motion_px) {
  const double needed = std::clamp(motion_px / kSpacing, 1.0, static_cast<double>(kMostSamples));
  return kPlaces * static_cast<std::size_t>(std::ceil(needed / static_cast<double>(kPlaces)));
}

double sample_time(std::size_t sample, std::size_t samples) {
  return (static_cast<double>(sample) + 0.5) / static_cast<double>(samples) - 0.5;
}

}  // namespace breakshot::sim_bridge
