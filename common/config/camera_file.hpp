#pragma once

#include "common/camera_model.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace breakshot {

/// Reads a camera's calibration (config/cameras/*.yaml): size, intrinsics, distortion and pose.
///
/// @throws ConfigError, also for a camera that does not look down: every ray of its image must meet the table
CameraModel load_camera(const std::filesystem::path& file);
/// As load_camera(), from a text; `name` stands for the file in errors.
CameraModel parse_camera(std::string_view text, const std::filesystem::path& name);

/// The text of a calibration file: reading it gives the camera again, to 1e-9 m, 1e-9 of a direction and 1e-6 px. `note` goes into a comment.
std::string camera_text(const CameraModel& camera, const std::string& note);

}  // namespace breakshot
