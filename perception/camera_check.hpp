#pragma once

#include <cstdint>
#include <string>

namespace breakshot::perception {

/// What the table's markers say of where the camera is.
struct CameraCheck {
  enum class Verdict : std::uint8_t {
    kNothing,  ///< no marker in view that the arm does not hide, or too little of them for a verdict
    kInPlace,
    kMoved,
    kUnseen,  ///< none of the markers is where it must be seen
  };
  Verdict verdict = Verdict::kNothing;
  int expected = 0;     ///< markers that are in the calibrated camera's view and not behind the arm
  int seen = 0;         ///< of these
  double shift = 0.0;   ///< largest distance by which a place of the table is taken for another one, in the workspace and at the markers, m
  double moved = 0.0;   ///< of the camera, m
  double turned = 0.0;  ///< rad
};

/// "in place", ...
const char* to_string(CameraCheck::Verdict verdict) noexcept;
/// What a check found that rings an alarm, for people. @param max_shift  that is allowed, m
std::string describe(const CameraCheck& check, double max_shift);

}  // namespace breakshot::perception
