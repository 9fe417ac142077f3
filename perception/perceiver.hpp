#pragma once

#include "common/camera_model.hpp"
#include "common/frames.hpp"
#include "common/scene.hpp"
#include "common/urdf/arm_description.hpp"
#include "perception/camera_check.hpp"
#include "perception/settings.hpp"

#include <memory>
#include <span>
#include <string>

namespace breakshot::perception {

/// Turns the images of one calibrated camera into scenes.
///
/// Knows the settings, the camera, the frames and where the arm's own joints say that the arm is, and nothing else: no poses from the
/// simulator, no idea where discs should be. Not thread-safe. One Perceiver per camera stream; it keeps the last frame's discs for identities and velocities only.
class Perceiver {
 public:
  /// @throws std::invalid_argument when the settings or the camera make no sense (no colours, a camera below the discs, ...)
  /// @param arm   what may hide discs; a description without links: unknown
  /// @param X_WB  pose of the arm's base
  Perceiver(const PerceptionSettings& settings, const CameraModel& camera, const ArmDescription& arm = {},
            const Pose& X_WB = Pose::Identity());
  ~Perceiver();
  Perceiver(Perceiver&&) noexcept;
  Perceiver& operator=(Perceiver&&) noexcept;

  /// The scene of one frame. Never throws for what a frame holds: a bad frame gives a scene without discs, whose quality and text say why.
  ///
  /// What the arm hides is known from its joints, or else from depth. With neither, a disc that is partly hidden is fitted to the largest
  /// part of its outline that lies on one circle.
  /// @param depth  registered to the colour frame, or null. One that does not fit is ignored, and said so
  /// @param X_WL   poses of the arm's links when the frame was exposed, or nothing
  /// @throws std::invalid_argument when X_WL is neither empty nor one pose per link
  /// Cost: about 4 ms for 1280 x 720 pixels and six discs on one core.
  Scene process(const ColorFrame& color, const DepthFrame* depth = nullptr, std::span<const Pose> X_WL = {});

  /// The scene of a frame that is not to be looked at for a reason from outside, such as its age.
  Scene refuse(const ColorFrame& color, const std::string& why);

  const CameraModel& camera() const noexcept;
  /// What the table's markers said of the camera's place when they were last looked at.
  const CameraCheck& camera_check() const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace breakshot::perception
