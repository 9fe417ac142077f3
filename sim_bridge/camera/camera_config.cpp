#include "sim_bridge/camera/camera_config.hpp"

#include "sim_bridge/camera/marker_print.hpp"

#include <limits>
#include <numbers>

namespace breakshot::sim_bridge {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// sRGB values of 0 to 255.
Rgb paint(double red, double green, double blue) {
  return {static_cast<float>(red / 255.0), static_cast<float>(green / 255.0), static_cast<float>(blue / 255.0)};
}

void load_light(const ConfigNode& node, LightSettings& light) {
  light.towards_W = node.vector3("light_from", {-1.0, 1.0}, "");
  // As the camera demands it, said here with the place in the file.
  if (light.towards_W.z() < 0.18 * light.towards_W.head<2>().norm() || light.towards_W.z() < 1e-3) {
    node.refuse("light_from", "a light that stands too low", "a direction at least 10 degrees above the table");
  }
  light.angular_radius = kDegree * node.number("light_radius_deg", {0.0, 28.0}, "deg");
  light.ambient = node.number("ambient", {0.0, 1.0}, "");
  light.shadows = node.flag("shadows");
}

}  // namespace

CameraSettings load_camera_settings(const ConfigNode& node, const CellConfig& cell) {
  CameraSettings camera;
  load_light(node, camera.light);
  camera.exposure.brightness = node.number("brightness", {0.0, kMaxBrightness}, "");
  const Vector3 balance = node.vector3("white_balance", {0.0, kMaxBrightness}, "");
  camera.exposure.white_balance = {balance.x(), balance.y(), balance.z()};

  camera.table.size = cell.table_size;
  const Vector3 table = node.vector3("table_rgb", {0.0, 255.0}, "");
  camera.table.rgb = paint(table.x(), table.y(), table.z());
  camera.table.texture = node.number("table_texture", {0.0, 1.0}, "");

  camera.table.markers = marker_prints(cell.table_markers);

  camera.move.by_W = 1e-3 * node.vector3("moved_mm", {-100.0, 100.0}, "mm");
  camera.move.turn_C = kDegree * node.vector3("moved_deg", {-10.0, 10.0}, "deg");

  camera.noise.enabled = node.flag("noise");
  camera.noise.read_sigma = node.number("read_noise", {0.0, 20.0}, "");
  camera.noise.shot_gain = node.number("shot_noise", {0.0, 1.0}, "");
  camera.noise.depth_subpixel = node.number("depth_subpixel", {0.0, 2.0}, "px");
  camera.seed = static_cast<std::uint64_t>(node.integer("seed", 0, std::numeric_limits<std::int64_t>::max()));

  camera.palette.clear();
  for (const Colour& colour : cell.colours) camera.palette.push_back(paint(colour.rgb[0], colour.rgb[1], colour.rgb[2]));
  return camera;
}

}  // namespace breakshot::sim_bridge
