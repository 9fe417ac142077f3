#pragma once

#include "common/camera_model.hpp"

#include <filesystem>

namespace breakshot {

/// Reads a camera's calibration (config/cameras/*.yaml): size, intrinsics, distortion and pose.
///
/// @throws ConfigError, also for a camera that does not look down: every ray of its image must meet the table
CameraModel load_camera(const std::filesystem::path& file);

}  // namespace breakshot
