#pragma once

#include "common/camera_model.hpp"
#include "common/random.hpp"
#include "perception/calibrate/board.hpp"

#include <opencv2/core.hpp>

#include <cstdint>

namespace breakshot::perception::test {

/// Pictures of a board through a real lens: every pixel is the mean of 16 rays through CameraModel, then blur, uneven light and noise. Shares nothing with
/// how boards are found and cameras solved but the camera model and the board's ink, which is checked against OpenCV's own drawing.
class BoardPainter {
 public:
  explicit BoardPainter(const Board& board);

  /// @param X_WP   of the board
  /// @param noise  standard deviation of a grey value
  cv::Mat1b paint(const CameraModel& camera, const Pose& X_WP, std::uint64_t seed, double noise = 2.0) const;

 private:
  Vector2 low_;       // of the raster, in P
  cv::Mat1b raster_;  // of the board with its white margin
};

}  // namespace breakshot::perception::test
