#pragma once

#include "common/frames.hpp"
#include "common/scene.hpp"
#include "perception/settings.hpp"

#include <array>
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
  static constexpr int kBands = 8;
  /// What a band of rows shows.
  struct Band {
    std::uint64_t hash = 0;
    bool varied = false;  ///< not one value all over, as overexposed table is
  };
  using Bands = std::array<Band, kBands>;
  static Bands content(const ColorFrame& frame) noexcept;
  std::optional<std::string> frozen(const Bands& bands) const;

  Time last_exposed_{};
  Bands last_content_{};
};

/// What is wrong with the age of a frame: older than `limit`, or from the future; nothing when it is fresh. Both times of the same clock.
std::optional<std::string> stale(const ColorFrame& frame, Time now, Duration limit);

/// Checks a depth frame against the calibrated camera and the colour frame that it belongs to; nothing when it is good.
std::optional<std::string> depth_fault(const DepthFrame& depth, const ColorFrame& color);

}  // namespace breakshot::perception
