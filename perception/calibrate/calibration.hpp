#pragma once

#include "common/camera_model.hpp"
#include "common/result.hpp"
#include "perception/calibrate/board.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::perception {

/// How the board was placed for a picture.
enum class BoardPlace : std::uint8_t {
  kTable,  ///< at a stated pose
  kArm,    ///< held at the striker's tip, always in the same way, which is found too
  kFree,   ///< anyhow: tells of the lens only
};

/// One picture for a calibration.
struct CalibrationView {
  BoardView seen;
  BoardPlace place = BoardPlace::kTable;
  Pose X_WP{Pose::Identity()};  ///< kTable: of the board
  Pose X_WT{Pose::Identity()};  ///< kArm: of the tip, by the joints
};

struct CalibrationSettings {
  bool intrinsics = false;       ///< find focal lengths, principal point and distortion too
  double max_residual = 0.5;     ///< px, RMS: more is refused
  double max_p_sigma = 0.5e-3;   ///< m, of the camera's position along its worst axis: less sure is refused
  double max_turn_sigma = 9e-4;  ///< rad
};

struct Calibration {
  CameraModel camera;
  std::optional<Pose> X_TP;                ///< of a board held by the arm
  double residual = 0.0;                   ///< px, RMS over all coordinates
  double p_sigma = 0.0;                    ///< m, standard deviation of the camera's position, along its worst axis
  double turn_sigma = 0.0;                 ///< rad, the same of its orientation
  Eigen::Matrix<double, 6, 6> covariance;  ///< of the pose: small rotation vector and shift, both in W (least_squares.hpp: nearby())
  double lens_sigma = 0.0;  ///< px: how well the lens is known where it is known worst in the image; 0 when it was taken as given
  struct PerView {
    std::string picture;
    int corners = 0;
    double residual = 0.0;  ///< px, RMS
  };
  std::vector<PerView> views;
};

/// Why a calibration is refused: what was found, and what is needed.
struct CalibrationRefusal {
  std::string text;
};

/// Finds the camera that explains the pictures.
///
/// Least squares over all corners, in which corners that fit badly count less (Huber). Refused: a board that was not found in a picture, too few
/// corners, pictures too much alike for what is asked, residuals that say that something is not as stated (a pose, a joint, a board that bends, a
/// lens), and a result that is not sure enough.
/// @param start  size of the image; intrinsics, taken as given unless settings.intrinsics; its pose is not used
Result<Calibration, CalibrationRefusal> calibrate(const std::vector<CalibrationView>& views, const Board& board, const CameraModel& start,
                                                  const CalibrationSettings& settings);

}  // namespace breakshot::perception
