#include "perception/perception_config.hpp"

#include "perception/hsv.hpp"

#include <string>

namespace breakshot::perception {
namespace {

constexpr double kMetrePerMillimetre = 1e-3;

int odd_pixels(const ConfigNode& node, const char* key) {
  const auto value = node.integer(key, 1, 31);
  if (value % 2 == 0) node.refuse(key, std::to_string(value), "an odd number of pixels from 1 to 31");
  return static_cast<int>(value);
}

}  // namespace

PerceptionConfig load_perception_config(const ConfigDocument& document, const CellConfig& cell) {
  const ConfigNode node = document.section("perception");
  PerceptionConfig config;
  PerceptionSettings& s = config.settings;
  for (const Colour& colour : cell.colours) {
    const HsvRange& hsv = colour.hsv;
    s.colours.push_back({colour.name, hsv.hue_min, hsv.hue_max, hsv.saturation_min, hsv.saturation_max, hsv.value_min, hsv.value_max,
                         to_hsv(colour.rgb[0], colour.rgb[1], colour.rgb[2]).hue_deg});
  }
  s.disc_height = cell.disc_height;
  s.radius_min = cell.disc_radius_min;
  s.radius_max = cell.disc_radius_max;
  s.p_WB = cell.arm.X_WB.translation().head<2>();

  s.method = node.choice("method", {"robust", "paper"}) == "paper" ? Method::kPaper : Method::kRobust;
  const Vector3 table = node.vector3("table_rgb", {8.0, 255.0}, "");
  s.table_rgb = {table.x(), table.y(), table.z()};
  s.morphology_px = odd_pixels(node, "morphology_px");
  s.edge_gamma = node.number("edge_gamma", {0.5, 3.0}, "");
  s.min_seen_arc_deg = node.number("min_seen_arc_deg", {30.0, 360.0}, "deg");
  s.edge_sigma_floor = kMetrePerMillimetre * node.number("edge_sigma_floor_mm", {0.0, 5.0}, "mm");
  s.edge_patch_sigma = kMetrePerMillimetre * node.number("edge_patch_sigma_mm", {0.0, 5.0}, "mm");
  s.edge_arc_sigma = kMetrePerMillimetre * node.number("edge_arc_sigma_mm", {0.0, 5.0}, "mm");
  s.edge_foot_sigma = kMetrePerMillimetre * node.number("edge_foot_sigma_mm", {0.001, 5.0}, "mm");
  s.edge_common_sigma = kMetrePerMillimetre * node.number("edge_common_sigma_mm", {0.0, 5.0}, "mm");
  s.touch_gap = kMetrePerMillimetre * node.number("touch_gap_mm", {0.0, 10.0}, "mm");
  s.arm_margin = kMetrePerMillimetre * node.number("arm_margin_mm", {0.0, 50.0}, "mm");
  s.occluder_height = node.number("occluder_height", {cell.disc_height, 1.0}, "m");
  s.max_disc_speed = node.number("max_disc_speed", {0.1, 20.0}, "m/s");
  s.dark_level = node.number("dark_level", {0.0, 255.0}, "of 255");

  const ConfigNode paper = node.child("paper");
  s.paper.thickness_px = odd_pixels(paper, "thickness_px");
  s.paper.min_overlap_px = static_cast<int>(paper.integer("min_overlap_px", 1, 1000));
  s.paper.cut_walls = paper.flag("cut_walls");

  s.watch.markers = cell.table_markers;
  s.watch.workspace = cell.workspace;
  const ConfigNode watch = node.child("camera_watch");
  s.watch.period = from_seconds(watch.number("period_s", {0.0, 60.0}, "s"));
  s.watch.max_shift = kMetrePerMillimetre * watch.number("max_shift_mm", {0.1, 20.0}, "mm");

  config.stale_limit = from_seconds(1e-3 * node.number("stale_limit_ms", {50.0, 10'000.0}, "ms"));
  config.depth_wait = from_seconds(1e-3 * node.number("depth_wait_ms", {0.0, 1000.0}, "ms"));
  config.silence_limit = from_seconds(node.number("silence_limit_s", {0.1, 60.0}, "s"));
  node.finish();
  return config;
}

}  // namespace breakshot::perception
