#include "controller/motion/motion_config.hpp"

namespace breakshot::motion {

namespace {

constexpr double kUnbounded = 1e6;

}  // namespace

MotionSettings load_motion_settings(const ConfigNode& node, const CellConfig& cell) {
  MotionSettings motion;
  motion.max_acceleration = node.number("max_acceleration", {0.1, 1000.0}, "rad/s^2");
  motion.max_jerk = node.number("max_jerk", {1.0, kUnbounded}, "rad/s^3");
  motion.max_hit_speed = node.number("max_hit_speed", {0.01, 5.0}, "m/s");
  motion.max_push_speed = node.number("max_push_speed", {0.01, 2.0}, "m/s");
  motion.max_run_in = node.number("max_run_in", {0.01, 2.0}, "m");
  motion.max_length = node.number("max_length", {0.01, 2.0}, "m");
  motion.clearance = node.number("clearance", {0.001, 0.2}, "m");
  motion.link_clearance = node.number("link_clearance", {0.0, 0.5}, "m");
  motion.run_in_band = node.number("run_in_band", {0.0, 0.1}, "m");
  motion.descent = node.number("descent", {0.0, 1.0}, "m");

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

  motion.striker_radius = cell.striker_radius;
  motion.tip_height = cell.tip_height;
  motion.disc_height = cell.disc_height;
  motion.park = cell.arm.park;
  return motion;
}

}  // namespace breakshot::motion
