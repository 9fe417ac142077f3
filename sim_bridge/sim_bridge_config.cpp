#include "sim_bridge/sim_bridge_config.hpp"

#include "sim_bridge/camera/camera_config.hpp"
#include "sim_bridge/camera/lighting.hpp"

#include <limits>

namespace breakshot::sim_bridge {
namespace {

constexpr double kMillisecond = 1e-3;
constexpr const char* kNoPreset = "as_below";  // what stands in place of a preset's name

Duration milliseconds(const ConfigNode& node, const char* key, Range range) {
  return from_seconds(kMillisecond * node.number(key, range, "ms"));
}

std::uint64_t seed(const ConfigNode& node, const char* key) {
  return static_cast<std::uint64_t>(node.integer(key, 0, std::numeric_limits<std::int64_t>::max()));
}

TablePhysics load_physics(const ConfigNode& node, const CellConfig& cell) {
  TablePhysics physics;
  physics.table = {-0.5 * cell.table_size, 0.5 * cell.table_size};
  physics.striker_radius = cell.striker_radius;
  physics.friction = node.number("friction", {0.0, 2.0}, "");
  physics.friction_spread = node.number("friction_spread", {0.0, 0.5}, "");
  physics.friction_seed = seed(node, "friction_seed");
  physics.restitution = node.number("restitution", {0.0, 1.0}, "");
  physics.striker_restitution = node.number("striker_restitution", {0.0, 1.0}, "");
  physics.bounce_speed = node.number("bounce_speed", {0.0, 1.0}, "m/s");
  physics.striker_bounce_speed = node.number("striker_bounce_speed", {0.0, 1.0}, "m/s");
  physics.contact_time = 1e-3 * node.number("contact_time_ms", {0.0, 10.0}, "ms");
  if (physics.contact_time > 0.0 && physics.contact_time < 1e-5) {
    node.refuse("contact_time_ms", "a contact shorter than 0.01 ms", "0 (impacts are instants), or 0.01 to 10");
  }
  physics.contact_friction = node.number("contact_friction", {0.0, 1.0}, "");
  return physics;
}

DriveSettings load_drives(const ConfigNode& node) {
  DriveSettings drives;
  drives.bandwidth = node.number("bandwidth", {10.0, 400.0}, "rad/s");
  drives.lag = milliseconds(node, "lag_ms", {0.0, 20.0});
  drives.rotor_inertia = node.number("rotor_inertia", {1e-3, 10.0}, "kg m^2");
  drives.brake_deceleration = node.number("brake_deceleration", {1.0, 100.0}, "rad/s^2");
  return drives;
}

}  // namespace

SimBridgeConfig load_sim_bridge_config(const ConfigDocument& document, const CellConfig& cell) {
  const ConfigNode node = document.section("sim_bridge");
  SimBridgeConfig config;
  config.formation = node.text("formation");
  config.gap_jitter = kMillisecond * node.number("gap_jitter_mm", {0.0, 5.0}, "mm");
  config.gap_seed = seed(node, "gap_seed");
  config.disc_mass = node.number("disc_mass", {1e-3, 10.0}, "kg");
  config.disc_mass_radius = node.number("disc_mass_radius", {5e-3, 0.2}, "m");

  config.sim.X_WB = cell.arm.X_WB;
  config.sim.q_start = cell.arm.park;
  config.sim.physics = load_physics(node.child("physics"), cell);
  config.sim.drives = load_drives(node.child("drives"));

  const ConfigNode camera = node.child("camera");
  config.camera = load_camera_settings(camera, cell);
  config.frame_period = from_seconds(1.0 / camera.number("frame_rate", {1.0, 120.0}, "Hz"));
  config.camera_latency = milliseconds(camera, "latency_ms", {0.0, 1000.0});
  config.camera_jitter = milliseconds(camera, "latency_jitter_ms", {0.0, 1000.0});
  config.lighting_folder = camera.folder("lighting_presets");
  const std::string lighting = camera.text("lighting");
  if (lighting != kNoPreset) apply_lighting(config.lighting_folder, lighting, config.camera);

  config.priority = static_cast<int>(node.integer("priority", 1, 98));
  node.finish();
  return config;
}

std::vector<SimDisc> discs_of(const Formation& formation, const SimBridgeConfig& config, const CellConfig& cell) {
  Formation opened = formation;
  if (config.gap_jitter > 0.0) {
    SplitMix64 random{config.gap_seed};
    jitter(opened, random, config.gap_jitter);
  }
  std::vector<SimDisc> discs;
  for (const FormationDisc& disc : opened.discs) {
    const double scale = disc.radius / config.disc_mass_radius;
    discs.push_back({.p_WD = disc.p_WD,
                     .radius = disc.radius,
                     .height = cell.disc_height,
                     .mass = config.disc_mass * scale * scale,
                     .colour = disc.colour});
  }
  return discs;
}

}  // namespace breakshot::sim_bridge
