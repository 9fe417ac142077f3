#pragma once

#include "common/frames.hpp"
#include "common/scene.hpp"
#include "perception/settings.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace breakshot::perception {

/// What is wrong with a frame.
struct ImageFault {
  SceneQuality quality = SceneQuality::kBadImage;
  std::string text;  ///< what was found and what is allowed
};

/// Refuses frames that carry no fresh picture of the table, before anybody looks for discs in them.
class ImageCheck {
 public:
  /// @param width, height  of the calibrated camera, px
  ImageCheck(int width, int height, double dark_level);

  /// Nothing when the frame is good. A stamp that goes backwards is refused once: the frame after it is judged against the new stamp, so
  /// a camera that was started anew is believed again at its second frame.
  std::optional<ImageFault> check(const ColorFrame& frame);

 private:
  int width_, height_;
  double dark_level_;
  bool any_ = false;
  Time last_exposed_{};
  std::uint64_t last_content_ = 0;
};

/// Checks a depth frame against the calibrated camera and the colour frame that it belongs to; nothing when it is good.
std::optional<std::string> depth_fault(const DepthFrame& depth, const ColorFrame& color);

}  // namespace breakshot::perception
