#pragma once

#include "common/camera_model.hpp"
#include "sim_bridge/camera/camera.hpp"
#include "tests/support/render_scene.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace breakshot::sim_bridge {

/// Settings that leave nothing in the picture but geometry: no noise, no shadows, no texture.
inline CameraSettings plain_settings() {
  CameraSettings settings;
  settings.noise.enabled = false;
  settings.light.shadows = false;
  settings.table.texture = 0.0;
  return settings;
}

/// A value of a picture between pixels, bilinear. The place must be inside by a pixel.
inline double value_at(const ColorFrame& frame, const Vector2& pixel, int channel) {
  const int x = static_cast<int>(std::floor(pixel.x())), y = static_cast<int>(std::floor(pixel.y()));
  const double u = pixel.x() - x, v = pixel.y() - y;
  const auto at = [&](int column, int row) {
    return static_cast<double>(frame.rgb[3 * static_cast<std::size_t>(row * frame.width + column) + static_cast<std::size_t>(channel)]);
  };
  return (1 - v) * ((1 - u) * at(x, y) + u * at(x + 1, y)) + v * ((1 - u) * at(x, y + 1) + u * at(x + 1, y + 1));
}

inline std::uint16_t depth_at(const DepthFrame& frame, const Vector2& pixel) {
  return frame.depth[static_cast<std::size_t>(std::lround(pixel.y()) * frame.width + std::lround(pixel.x()))];
}

inline std::array<int, 3> colour_at(const ColorFrame& frame, const Vector2& pixel) {
  const auto first = 3 * static_cast<std::size_t>(std::lround(pixel.y()) * frame.width + std::lround(pixel.x()));
  return {frame.rgb[first], frame.rgb[first + 1], frame.rgb[first + 2]};
}

/// A camera of the cell, turned and moved: still sees the whole middle of the table.
inline CameraModel tilted_camera() {
  CameraModel camera = support::cell_camera();
  camera.X_WC.translation() = Vector3{0.10, -0.35, 0.75};
  camera.X_WC.rotate(Eigen::AngleAxisd{0.4, Vector3::UnitX()});
  camera.X_WC.rotate(Eigen::AngleAxisd{0.1, Vector3::UnitZ()});
  return camera;
}

}  // namespace breakshot::sim_bridge
