#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "sim_bridge/camera/camera_settings.hpp"

namespace breakshot::sim_bridge {

/// Reads what the rendered camera needs from the map `sim_bridge.camera`; size of the table and colours of the discs come from `cell`.
/// Leaves the keys that are not about the picture (frame rate, latency) to the caller.
/// @throws ConfigError
CameraSettings load_camera_settings(const ConfigNode& node, const CellConfig& cell);

}  // namespace breakshot::sim_bridge
