#pragma once

#include "common/camera_model.hpp"
#include "common/geometry.hpp"
#include "common/urdf/arm_description.hpp"

#include <opencv2/core.hpp>

#include <cmath>
#include <span>
#include <vector>

namespace breakshot::perception {

/// The part of the image where the arm stands between the camera and the table, by the arm's own kinematics.
///
/// Needs no depth and no colour: what the arm hides is known from where its joints were when the frame was exposed.
class ArmMask {
 public:
  /// @param arm     its collision shapes count; a description without links hides nothing
  /// @param X_WB    pose of the arm's base
  /// @param margin  by which every shape is taken larger: the errors of calibration, joints and shapes together, m
  ArmMask(const CameraModel& camera, const ArmDescription& arm, const Pose& X_WB, double margin);

  /// Puts the arm where its links are. @param X_WL  poses of the moving links, or nothing: then the mask is empty
  /// @throws std::invalid_argument when it is neither one pose per link nor none
  /// Cost: about 0.3 ms for six joints.
  void place(std::span<const Pose> X_WL);

  /// Whether the arm may hide what is seen at a place of the image. Outside of the image: no.
  bool covers(const Vector2& pixel) const noexcept {
    if (!known_) return false;
    const auto x = static_cast<int>(std::lround(pixel.x()));
    const auto y = static_cast<int>(std::lround(pixel.y()));
    return x >= 0 && y >= 0 && x < mask_.cols && y < mask_.rows && mask_(y, x) != 0;
  }

 private:
  using Corners = std::vector<Vector3>;  // of a convex piece, in the frame of its link
  std::vector<Corners> pieces_of(const LinkDescription& link) const;
  void draw(const Corners& piece, const Pose& X_WL);

  CameraModel camera_;
  double margin_;
  double max_range_;  // normalised image coordinates: farther out a lens model may fold back into the image
  Pose X_WB_;
  std::vector<Corners> base_;
  std::vector<std::vector<Corners>> links_;
  bool known_ = false;
  cv::Mat1b mask_;
  std::vector<cv::Point> corners_px_, hull_px_;
};

}  // namespace breakshot::perception
