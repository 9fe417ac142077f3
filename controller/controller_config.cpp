#include "controller/controller_config.hpp"

#include "controller/motion/motion_config.hpp"

#include <cmath>
#include <string>

namespace breakshot::control {

namespace {

Duration milliseconds(const ConfigNode& node, const char* key, Range range) { return from_seconds(1e-3 * node.number(key, range, "ms")); }

}  // namespace

ControllerConfig load_controller_config(const ConfigDocument& document, const CellConfig& cell) {
  const ConfigNode node = document.section("controller");
  ControllerConfig config;
  config.motion = motion::load_motion_settings(node.child("motion"), cell);

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
  config.realtime.priority = static_cast<int>(realtime.integer("priority", 2, 98));
  config.io_priority = static_cast<int>(realtime.integer("io_priority", 1, config.realtime.priority));
  config.realtime.cpu = static_cast<int>(realtime.integer("cpu", -1, 1023));
  config.lock_memory = realtime.flag("lock_memory");
  const auto wake_latency = static_cast<int>(realtime.integer("wake_latency_us", -1, 1'000'000));
  config.realtime.wake_latency_us = wake_latency < 0 ? std::nullopt : std::optional{wake_latency};

  const ConfigNode flight = node.child("flight");
  config.flight.folder = flight.path("folder");
  config.flight.files = static_cast<std::size_t>(flight.integer("files", 0, 1000));

  node.finish();
  if (cell.mode == CellMode::kLockstep) loop = lockstep(loop);
  return config;
}

safety::JointLimits joint_limits(const ArmDescription& arm, const motion::StopLimits& stop) {
  safety::JointLimits limits;
  limits.joints = static_cast<int>(arm.joints.size());
  for (std::size_t j = 0; j < arm.joints.size(); ++j) {
    limits.lower[j] = arm.joints[j].lower;
    limits.upper[j] = arm.joints[j].upper;
    limits.max_speed[j] = arm.joints[j].max_speed;
    limits.max_acceleration[j] = stop.acceleration;
  }
  return limits;
}

}  // namespace breakshot::control
