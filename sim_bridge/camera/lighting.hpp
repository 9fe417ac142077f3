#pragma once

#include "sim_bridge/camera/camera_settings.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot::sim_bridge {

// Lighting presets: files in config/lighting, each with one map `lighting` that holds a `description` and any of the picture's keys of
// `sim_bridge.camera` (docs/configuration.md), under the same names and within the same bounds.
//
//     CameraSettings settings = load_sim_bridge_config(document, cell).camera;
//     apply_lighting(load_sim_bridge_config(document, cell).lighting_folder, "two_lamps", settings);
//
// What changes with time (drift, moving shadow) follows WorldSnapshot::stamp; what is drawn at random follows settings.seed and the frame's number.

/// Names of the presets in a folder, sorted. @throws ConfigError when the folder cannot be read
std::vector<std::string> lighting_names(const std::filesystem::path& folder);

/// Puts what a preset says in the place of what `settings` has; what it does not say stays as it is.
/// @throws ConfigError for a preset that is not there (says which are), for unknown keys and values out of their bounds
void apply_lighting(const std::filesystem::path& folder, std::string_view name, CameraSettings& settings);

}  // namespace breakshot::sim_bridge
