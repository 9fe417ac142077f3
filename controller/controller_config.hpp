#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "common/urdf/arm_description.hpp"
#include "controller/loop/control_loop.hpp"
#include "controller/motion/motion_settings.hpp"
#include "controller/rt/realtime.hpp"

namespace breakshot::control {

/// All that the controller is told.
struct ControllerConfig {
  motion::MotionSettings motion;
  LoopConfig loop;  ///< without the joints' limits: joint_limits() adds them when the arm is known
  rt::RealtimeSettings realtime;
  bool lock_memory = true;
};

/// Reads section `controller`, with what the section `cell` says of table, striker and mode.
/// @throws ConfigError
ControllerConfig load_controller_config(const ConfigDocument& document, const CellConfig& cell);

/// Ranges and speeds as the arm's description has them; `max_acceleration` for every joint.
safety::JointLimits joint_limits(const ArmDescription& arm, double max_acceleration);

}  // namespace breakshot::control
