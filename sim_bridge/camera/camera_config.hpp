#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "sim_bridge/camera/camera_settings.hpp"

namespace breakshot::sim_bridge {

/// Which keys of the picture a map must have.
enum class PictureKeys : bool { kAll, kAny };

/// Reads light, sensor and table from a map: `sim_bridge.camera` with all of its keys, or a lighting preset with any of them. Those that are
/// not about the picture (frame rate, latency) are left to the caller.
/// @throws ConfigError
void read_picture(const ConfigNode& node, PictureKeys keys, CameraSettings& camera);

/// What the rendered camera needs from `sim_bridge.camera`; size of the table and colours of the discs come from `cell`.
/// @throws ConfigError
CameraSettings load_camera_settings(const ConfigNode& node, const CellConfig& cell);

}  // namespace breakshot::sim_bridge
