#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "common/urdf/arm_description.hpp"
#include "controller/flight/flight_recorder.hpp"
#include "controller/loop/control_loop.hpp"
#include "controller/motion/motion_settings.hpp"
#include "controller/rt/realtime.hpp"

namespace breakshot::control {

/// All that the controller is told.
struct ControllerConfig {
  motion::MotionSettings motion;
  LoopConfig loop;  ///< without the joints' limits: joint_limits() adds them when the arm is known
  rt::RealtimeSettings realtime;
  int io_priority = 60;  ///< SCHED_FIFO of the threads that bring states and take commands away
  bool lock_memory = true;
  flight::RecorderSettings flight;
};

/// Reads section `controller`, with what the section `cell` says of table, striker and mode.
/// @throws ConfigError
ControllerConfig load_controller_config(const ConfigDocument& document, const CellConfig& cell);

/// What every command to this arm is held against: ranges and speeds as its description has them; the stops' acceleration, because a stop may ask
/// for more than strokes may.
safety::JointLimits joint_limits(const ArmDescription& arm, const motion::StopLimits& stop);

}  // namespace breakshot::control
