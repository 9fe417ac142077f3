#include "sim_bridge/camera/camera_config.hpp"

#include "sim_bridge/camera/marker_print.hpp"

#include <limits>
#include <numbers>
#include <string_view>

namespace breakshot::sim_bridge {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMillisecond = 1e-3;
constexpr Range kKelvin{1500.0, 20000.0};

/// sRGB values of 0 to 255.
Rgb paint(double red, double green, double blue) {
  return {static_cast<float>(red / 255.0), static_cast<float>(green / 255.0), static_cast<float>(blue / 255.0)};
}

/// Reads keys that must be there, or those that are.
class Picture {
 public:
  Picture(const ConfigNode& node, PictureKeys keys) : node_{node}, keys_{keys} {}

  bool wants(std::string_view key) const { return keys_ == PictureKeys::kAll || node_.has(key); }
  void number(std::string_view key, Range range, std::string_view unit, double& into, double factor = 1.0) const {
    if (wants(key)) into = factor * node_.number(key, range, unit);
  }
  void flag(std::string_view key, bool& into) const {
    if (wants(key)) into = node_.flag(key);
  }
  Picture child(std::string_view key) const { return {node_.child(key), keys_}; }
  const ConfigNode& node() const { return node_; }

 private:
  ConfigNode node_;
  PictureKeys keys_;
};

LampSettings read_lamp(const ConfigNode& node) {
  LampSettings lamp;
  lamp.towards_W = node.vector3("from", {-1.0, 1.0}, "");
  // As the camera demands it, said here with the place in the file.
  if (lamp.towards_W.z() < 0.18 * lamp.towards_W.head<2>().norm() || lamp.towards_W.z() < 1e-3) {
    node.refuse("from", "a lamp that stands too low", "a direction at least 10 degrees above the table");
  }
  lamp.angular_radius = kDegree * node.number("radius_deg", {0.0, 28.0}, "deg");
  lamp.share = node.number("share", {0.01, 100.0}, "");
  lamp.kelvin = node.number("kelvin", kKelvin, "K");
  return lamp;
}

void read_light(const Picture& picture, LightSettings& light) {
  if (picture.wants("lamps")) {
    light.lamps.clear();
    for (const ConfigNode& item : picture.node().items("lamps")) light.lamps.push_back(read_lamp(item));
    if (light.lamps.empty() || light.lamps.size() > kMaxLamps) {
      picture.node().refuse("lamps", std::to_string(light.lamps.size()) + " lamps", "1 to " + std::to_string(kMaxLamps) + " lamps");
    }
  }
  picture.number("ambient", {0.0, 1.0}, "", light.ambient);
  picture.number("ambient_kelvin", kKelvin, "K", light.ambient_kelvin);
  picture.number("white_balance_kelvin", kKelvin, "K", light.balanced_kelvin);
  picture.flag("shadows", light.shadows);
}

void read_changes(const Picture& picture, CameraSettings& camera) {
  picture.number("brightness_ramp", {0.01, 100.0}, "", camera.drift.brightness_ramp);
  picture.number("brightness_ramp_s", {0.1, 3600.0}, "s", camera.drift.brightness_ramp_time);
  picture.number("white_balance_drift", {0.0, 0.5}, "", camera.drift.white_balance);
  picture.number("white_balance_drift_s", {0.1, 3600.0}, "s", camera.drift.white_balance_period);
  if (!picture.wants("moving_shadow")) return;
  const Picture band = picture.child("moving_shadow");
  band.number("depth", {0.0, 1.0}, "", camera.moving_shadow.depth);
  band.number("width", {0.0, 2.0}, "m", camera.moving_shadow.width);
  band.number("edge", {0.01, 1.0}, "m", camera.moving_shadow.edge);
  band.number("speed", {0.0, 5.0}, "m/s", camera.moving_shadow.speed);
  band.number("direction_deg", {-360.0, 360.0}, "deg", camera.moving_shadow.direction, kDegree);
}

void read_sensor(const Picture& picture, CameraSettings& camera) {
  picture.number("exposure_ms", {0.0, 33.0}, "ms", camera.exposure_time, kMillisecond);
  picture.number("brightness", {0.0, kMaxBrightness}, "", camera.exposure.brightness);
  if (picture.wants("white_balance")) {
    const Vector3 balance = picture.node().vector3("white_balance", {0.0, kMaxBrightness}, "");
    camera.exposure.white_balance = {balance.x(), balance.y(), balance.z()};
  }
  picture.flag("noise", camera.noise.enabled);
  picture.number("read_noise", {0.0, 20.0}, "", camera.noise.read_sigma);
  picture.number("shot_noise", {0.0, 1.0}, "", camera.noise.shot_gain);
  picture.number("depth_subpixel", {0.0, 2.0}, "px", camera.noise.depth_subpixel);
  picture.flag("depth_shadow", camera.depth_flaws.shadow);
  picture.number("depth_holes", {0.0, 1.0}, "", camera.depth_flaws.holes);
  picture.number("depth_bleed_px", {0.0, 8.0}, "px", camera.depth_flaws.bleed);
  if (picture.wants("seed"))
    camera.seed = static_cast<std::uint64_t>(picture.node().integer("seed", 0, std::numeric_limits<std::int64_t>::max()));
}

}  // namespace

void read_picture(const ConfigNode& node, PictureKeys keys, CameraSettings& camera) {
  const Picture picture{node, keys};
  read_light(picture, camera.light);
  read_changes(picture, camera);
  read_sensor(picture, camera);
  picture.number("disc_shine", {0.0, 10.0}, "", camera.shine.strength);
  picture.number("disc_gloss", {1.0, 2000.0}, "", camera.shine.gloss);
  if (picture.wants("table_rgb")) {
    const Vector3 table = node.vector3("table_rgb", {0.0, 255.0}, "");
    camera.table.rgb = paint(table.x(), table.y(), table.z());
  }
  picture.number("table_texture", {0.0, 1.0}, "", camera.table.texture);
}

CameraSettings load_camera_settings(const ConfigNode& node, const CellConfig& cell) {
  CameraSettings camera;
  read_picture(node, PictureKeys::kAll, camera);
  camera.table.size = cell.table_size;

  camera.table.markers = marker_prints(cell.table_markers);

  camera.move.by_W = 1e-3 * node.vector3("moved_mm", {-100.0, 100.0}, "mm");
  camera.move.turn_C = kDegree * node.vector3("moved_deg", {-10.0, 10.0}, "deg");

  camera.palette.clear();
  for (const Colour& colour : cell.colours) camera.palette.push_back(paint(colour.rgb[0], colour.rgb[1], colour.rgb[2]));
  return camera;
}

}  // namespace breakshot::sim_bridge
