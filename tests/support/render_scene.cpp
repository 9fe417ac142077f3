#include "tests/support/render_scene.hpp"

#include <cmath>
#include <numbers>

namespace breakshot::support {

CameraModel cell_camera() {
  CameraModel camera;
  camera.fx = camera.fy = 914.0;  // a D435i's colour camera at 1280 x 720 (librealsense #8689)
  camera.cx = 639.5;
  camera.cy = 359.5;
  camera.X_WC.translation() = Vector3{0.0, 0.0, 0.8};
  camera.X_WC.linear() << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
  return camera;
}

sim_bridge::DiscState disc_at(double x, double y, std::uint8_t colour, double radius) {
  sim_bridge::DiscState disc;
  disc.p_WD = {x, y};
  disc.colour = colour;
  disc.radius = radius;
  return disc;
}

std::vector<sim_bridge::DiscState> rack_of_six(const Vector2& front, double gap) {
  std::vector<sim_bridge::DiscState> discs;
  const double pitch = 2.0 * 0.030 + gap;
  for (int row = 0; row < 3; ++row) {
    for (int i = 0; i <= row; ++i) {
      discs.push_back(disc_at(front.x() + row * pitch * 0.5 * std::numbers::sqrt3, front.y() + (i - 0.5 * row) * pitch,
                              static_cast<std::uint8_t>(discs.size())));
    }
  }
  return discs;
}

SceneRenderer::SceneRenderer(const sim_bridge::CameraSettings& settings, const CameraModel& camera, const ArmDescription& arm,
                             const Pose& X_WB)
    : camera_{camera, settings, arm, X_WB} {}

RenderedScene SceneRenderer::take(std::span<const sim_bridge::DiscState> discs, std::uint64_t frame, std::span<const Pose> X_WL,
                                  Time stamp) {
  const CameraModel& model = camera_.model();
  RenderedScene scene;
  scene.camera = model;
  scene.truth.assign(discs.begin(), discs.end());
  const auto pixels = static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
  scene.color = {frame, {}, model.width, model.height, std::vector<std::uint8_t>(3 * pixels)};
  scene.depth = {frame, {}, model.width, model.height, std::vector<std::uint16_t>(pixels)};
  sim_bridge::WorldSnapshot snapshot;
  snapshot.stamp = stamp;
  snapshot.discs = scene.truth;
  snapshot.X_WL.assign(X_WL.begin(), X_WL.end());
  camera_.render(snapshot, frame, scene.color.rgb, scene.depth.depth);
  return scene;
}

}  // namespace breakshot::support
