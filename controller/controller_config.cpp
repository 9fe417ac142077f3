#include "controller/controller_config.hpp"

#include <cmath>
#include <string>

namespace breakshot::control {

namespace {

constexpr double kUnbounded = 1e6;

Duration milliseconds(const ConfigNode& node, const char* key, Range range) { return from_seconds(1e-3 * node.number(key, range, "ms")); }

motion::MotionSettings load_motion(const ConfigNode& node, const CellConfig& cell) {
  motion::MotionSettings motion;
  motion.max_acceleration = node.number("max_acceleration", {0.1, 1000.0}, "rad/s^2");
  motion.max_jerk = node.number("max_jerk", {1.0, kUnbounded}, "rad/s^3");
  motion.max_hit_speed = node.number("max_hit_speed", {0.01, 5.0}, "m/s");
  motion.max_push_speed = node.number("max_push_speed", {0.01, 2.0}, "m/s");
  motion.max_run_in = node.number("max_run_in", {0.01, 2.0}, "m");
  motion.max_length = node.number("max_length", {0.01, 2.0}, "m");
  motion.clearance = node.number("clearance", {0.001, 0.2}, "m");
  motion.link_clearance = node.number("link_clearance", {0.0, 0.5}, "m");
  motion.run_in_band = node.number("run_in_band", {0.0, 0.1}, "m");

  const ConfigNode area = node.child("striker_area");
  motion.striker_area = {area.vector2("min", {-2.0, 2.0}), area.vector2("max", {-2.0, 2.0})};
  if ((motion.striker_area.min.array() >= motion.striker_area.max.array()).any()) {
    area.refuse("max", "a corner that is not beyond min", "max greater than min in x and y");
  }
  if (!motion.striker_area.contains(cell.workspace.min) || !motion.striker_area.contains(cell.workspace.max)) {
    node.refuse("striker_area", "an area smaller than cell.workspace",
                "one that contains the workspace, with room around it to strike from outside");
  }

  const ConfigNode stop = node.child("stop");
  motion.stop.acceleration = stop.number("acceleration", {motion.max_acceleration, 1000.0}, "rad/s^2");
  motion.stop.jerk = stop.number("jerk", {motion.max_jerk, kUnbounded}, "rad/s^3");

  motion.tip_height = cell.tip_height;
  motion.disc_height = cell.disc_height;
  motion.park = cell.arm.park;
  return motion;
}

}  // namespace

ControllerConfig load_controller_config(const ConfigDocument& document, const CellConfig& cell) {
  const ConfigNode node = document.section("controller");
  ControllerConfig config;
  config.motion = load_motion(node.child("motion"), cell);

  LoopConfig& loop = config.loop;
  loop.period = config.motion.tick;
  loop.stop = config.motion.stop;
  loop.lead = milliseconds(node, "lead_ms", {0.0, 50.0});
  loop.drive_lag = milliseconds(node, "drive_lag_ms", {0.0, 50.0});

  const ConfigNode safety = node.child("safety");
  loop.freshness.predict_ticks = static_cast<int>(safety.integer("predict_ticks", 1, 100));
  loop.freshness.stop_ticks = static_cast<int>(safety.integer("stop_ticks", loop.freshness.predict_ticks, 200));
  loop.freshness.stop_after = milliseconds(safety, "stop_after_ms", {1.0, 1000.0});
  loop.max_state_age = milliseconds(safety, "max_state_age_ms", {1.0, 1000.0});
  loop.following.floor = safety.number("following_error", {1e-4, 1.0}, "rad");
  loop.following.per_speed = safety.number("following_error_per_speed", {0.0, 1.0}, "s");
  loop.give_way_tolerance = safety.number("give_way_tolerance", {1e-4, loop.following.floor}, "rad");
  loop.rest_speed = safety.number("rest_speed", {1e-4, 1.0}, "rad/s");

  const ConfigNode realtime = node.child("realtime");
  config.realtime.priority = static_cast<int>(realtime.integer("priority", 1, 98));
  config.realtime.cpu = static_cast<int>(realtime.integer("cpu", -1, 1023));
  config.lock_memory = realtime.flag("lock_memory");

  node.finish();
  if (cell.mode == CellMode::kLockstep) loop = lockstep(loop);
  return config;
}

safety::JointLimits joint_limits(const ArmDescription& arm, double max_acceleration) {
  safety::JointLimits limits;
  limits.joints = static_cast<int>(arm.joints.size());
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    limits.lower[j] = arm.joints[j].lower;
    limits.upper[j] = arm.joints[j].upper;
    limits.max_speed[j] = arm.joints[j].max_speed;
    limits.max_acceleration[j] = max_acceleration;
  }
  return limits;
}

}  // namespace breakshot::control
