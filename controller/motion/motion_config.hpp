#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "controller/motion/motion_settings.hpp"

namespace breakshot::motion {

/// Reads the map `controller.motion`, with what section `cell` says of table, discs and park pose. Controller and planner must agree on it: the
/// planner asks the motion library what the controller will do.
/// @throws ConfigError
MotionSettings load_motion_settings(const ConfigNode& node, const CellConfig& cell);

}  // namespace breakshot::motion
