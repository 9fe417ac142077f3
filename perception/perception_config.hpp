#pragma once

#include "common/config/cell_config.hpp"
#include "common/time.hpp"
#include "perception/settings.hpp"

namespace breakshot::perception {

/// Everything that the process `breakshot-perception` reads from the configuration.
struct PerceptionConfig {
  PerceptionSettings settings;
  Duration stale_limit{};    ///< frames with older stamps are refused, in real time
  Duration depth_wait{};     ///< how long a colour frame waits for the depth frame of the same number
  Duration silence_limit{};  ///< without a frame for so long, the process reports itself degraded
};

/// Reads the section `perception` whole and takes the rest from `cell`.
/// @throws ConfigError
PerceptionConfig load_perception_config(const ConfigDocument& document, const CellConfig& cell);

}  // namespace breakshot::perception
