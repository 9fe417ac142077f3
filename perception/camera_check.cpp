#include "perception/camera_check.hpp"

#include <cstdio>
#include <numbers>

namespace breakshot::perception {

const char* to_string(CameraCheck::Verdict verdict) noexcept {
  switch (verdict) {
    case CameraCheck::Verdict::kNothing: return "nothing";
    case CameraCheck::Verdict::kInPlace: return "in place";
    case CameraCheck::Verdict::kMoved: return "moved";
    case CameraCheck::Verdict::kUnseen: return "unseen";
  }
  return "invalid";
}

std::string describe(const CameraCheck& check, double max_shift) {
  char text[255];
  if (check.verdict == CameraCheck::Verdict::kUnseen) {
    std::snprintf(
        text, sizeof text,
        "none of the %d markers on the table is seen where the camera's calibration puts them: clear the view, or calibrate again",
        check.expected);
  } else {
    std::snprintf(
        text, sizeof text,
        "the camera has moved by %.1f mm and %.2f deg: the table seems shifted by up to %.2f mm (%d of %d markers seen); allowed: %.2f mm; "
        "put it back, or calibrate again",
        1e3 * check.moved, check.turned * 180.0 / std::numbers::pi, 1e3 * check.shift, check.seen, check.expected, 1e3 * max_shift);
  }
  return text;
}

}  // namespace breakshot::perception
