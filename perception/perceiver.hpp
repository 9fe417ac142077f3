#pragma once

#include "common/camera_model.hpp"
#include "common/frames.hpp"
#include "common/scene.hpp"
#include "perception/settings.hpp"

#include <memory>

namespace breakshot::perception {

/// Turns the images of one calibrated camera into scenes.
///
/// Knows the settings, the camera and the frames that it was given, and nothing else: no poses from the simulator, no idea where discs
/// should be. Not thread-safe. One Perceiver per camera stream; it keeps the last frame's discs for identities and velocities only.
class Perceiver {
 public:
  /// @throws std::invalid_argument when the settings or the camera make no sense (no colours, a camera below the discs, ...)
  Perceiver(const PerceptionSettings& settings, const CameraModel& camera);
  ~Perceiver();
  Perceiver(Perceiver&&) noexcept;
  Perceiver& operator=(Perceiver&&) noexcept;

  /// The scene of one frame. Never throws for what a frame holds: a bad frame gives a scene without discs, whose quality and text say why.
  /// @param depth  registered to the colour frame, or null; used to tell the arm from the table. One that does not fit is ignored, and said so
  /// Cost: about 4 ms for 1280 x 720 pixels and six discs on one core.
  Scene process(const ColorFrame& color, const DepthFrame* depth = nullptr);

  const CameraModel& camera() const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace breakshot::perception
