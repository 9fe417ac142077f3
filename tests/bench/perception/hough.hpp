#pragma once

#include "common/camera_model.hpp"
#include "common/frames.hpp"
#include "tests/bench/perception/score.hpp"

#include <string>

namespace breakshot::bench {

/// What OpenCV's HoughCircles is called with.
struct HoughSettings {
  bool gradient_alt = true;  ///< HOUGH_GRADIENT_ALT rather than HOUGH_GRADIENT
  bool saturation = false;   ///< on the saturation of the colours rather than on grey
  double dp = 2.0;           ///< resolution of the accumulator, image pixels
  double edge = 100.0;       ///< param1: upper threshold of Canny
  double votes = 0.95;       ///< param2: roundness for ALT (0 to 1), votes else
  double blur = 1.0;         ///< standard deviation of a Gaussian before, px
};
std::string to_string(const HoughSettings& settings);

/// Circles of HoughCircles, put on the plane of the discs' top faces and so freed of parallax; pairs whose gap is below `touch_gap` touch.
Finding hough(const ColorFrame& frame, const CameraModel& camera, double disc_height, double radius_min, double radius_max,
              double touch_gap, const HoughSettings& settings);

}  // namespace breakshot::bench
