#pragma once

#include "perception/calibrate/calibration.hpp"
#include "perception/calibrate/initial_guess.hpp"

#include <optional>
#include <vector>

namespace breakshot::perception {

/// Each picture by itself, and all corners together: is there enough?
std::optional<CalibrationRefusal> check_views(const std::vector<CalibrationView>& views, const Board& board, const CameraModel& camera);

/// Do the pictures of a board at the arm, if any, differ as much as it takes?
std::optional<CalibrationRefusal> check_arm(const std::vector<CalibrationView>& views);
/// And those for a lens?
std::optional<CalibrationRefusal> check_lens(const std::vector<CalibrationView>& views, const Guess& guess);

/// Is the result good, and sure enough?
std::optional<CalibrationRefusal> check_result(const Calibration& result, const CalibrationSettings& settings);

}  // namespace breakshot::perception
