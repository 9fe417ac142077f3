#pragma once

#include "common/camera_model.hpp"
#include "common/frames.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/camera/camera.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace breakshot::support {

/// The camera of the cell: 1280 x 720, fx = fy = 914, 0.8 m above W's origin, looking straight down, image x along x_W, y against y_W.
CameraModel cell_camera();

/// A disc of the cell (R = 30 mm, height 20 mm) that lies still.
sim_bridge::DiscState disc_at(double x, double y, std::uint8_t colour, double radius = 0.030);
/// Six touching discs as a rack that points to -x, in six colours of the default palette; `gap` is between neighbours, m.
std::vector<sim_bridge::DiscState> rack_of_six(const Vector2& front, double gap = 0.0);

/// One picture and what is truly on it.
struct RenderedScene {
  CameraModel camera;
  ColorFrame color;
  DepthFrame depth;
  std::vector<sim_bridge::DiscState> truth;
};

/// Takes pictures of discs for tests of perception, with the camera that the cell uses.
///
/// Making one takes about 0.3 s (GL starts, the background is rendered), a picture about 10 ms: make one per test suite.
///
///     support::SceneRenderer renderer;                                 // default palette: red, green, blue, yellow, purple, orange
///     const auto scene = renderer.take(support::rack_of_six({0, 0}));  // scene.color.rgb, scene.depth.depth, scene.truth
///
/// Pictures of the same discs with different frame numbers differ in noise only. For no noise, other light or another palette pass
/// settings; light that drifts follows `stamp`; set_exposure() makes it dark or turns the white balance from the next picture on. The arm is not in these pictures unless
/// one is given; then take() needs the poses of its links.
class SceneRenderer {
 public:
  explicit SceneRenderer(const sim_bridge::CameraSettings& settings = {}, const CameraModel& camera = cell_camera(),
                         const ArmDescription& arm = {}, const Pose& X_WB = Pose{Eigen::Translation3d{-0.5, 0.0, 0.0}});

  RenderedScene take(std::span<const sim_bridge::DiscState> discs, std::uint64_t frame = 0, std::span<const Pose> X_WL = {},
                     Time stamp = {});
  void set_exposure(const sim_bridge::Exposure& exposure) { camera_.set_exposure(exposure); }

 private:
  sim_bridge::Camera camera_;
};

}  // namespace breakshot::support
