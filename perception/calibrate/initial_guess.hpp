#pragma once

#include "perception/calibrate/calibration.hpp"

#include <vector>

namespace breakshot::perception {

/// Where the fit begins: good to a few pixels.
struct Guess {
  CameraModel camera;
  std::vector<Pose> X_CP;       ///< of each view's board
  Pose X_TP{Pose::Identity()};  ///< kArm
};

/// In closed form: each board by itself, the lens by Zhang's method, the arm's board by that of Shah for robot, world, hand and eye.
Result<Guess, CalibrationRefusal> initial_guess(const std::vector<CalibrationView>& views, const CameraModel& start, bool intrinsics);

}  // namespace breakshot::perception
