#pragma once

#include "common/process/process.hpp"

namespace breakshot::ros {

/// Republishes joint states (50 Hz), the colour image (5 Hz) and markers of scene and plan (10 Hz) as standard ROS 2 messages on the ROS domain,
/// until the process is to stop. Only outward: nothing that a ROS node sends reaches the cell.
void run_ros_gateway(process::Process& process);

}  // namespace breakshot::ros
