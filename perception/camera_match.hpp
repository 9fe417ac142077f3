#pragma once

#include "common/camera_model.hpp"

#include <optional>
#include <string>

namespace breakshot::perception {

/// What differs between the calibration that we work with and the one that the camera announces: the first figure, with both values; nothing
/// when they agree. Measuring with a wrong calibration would give wrong places that look right.
std::optional<std::string> camera_mismatch(const CameraModel& calibrated, const CameraModel& announced);

}  // namespace breakshot::perception
