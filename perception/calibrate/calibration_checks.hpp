#pragma once

#include "perception/calibrate/calibration.hpp"
#include "perception/calibrate/initial_guess.hpp"

#include <optional>
#include <vector>

namespace breakshot::perception {

/// Each picture by itself, and all corners together: is there enough?
std::optional<CalibrationRefusal> check_views(const std::vector<CalibrationView>& views, const Board& board, const CameraModel& camera);

/// Do the pictures differ as much as what is asked for takes?
std::optional<CalibrationRefusal> check_variety(const std::vector<CalibrationView>& views, const Guess& guess, bool intrinsics);

/// Is the result good, and sure enough?
std::optional<CalibrationRefusal> check_result(const Calibration& result, const CalibrationSettings& settings);

}  // namespace breakshot::perception
