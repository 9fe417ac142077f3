#pragma once

#include <algorithm>

namespace breakshot::perception {

struct Hsv {
  double hue_deg = 0.0, saturation = 0.0, value = 0.0;  ///< [0, 360), [0, 1], [0, 1]
};

/// @param r, g, b  [0, 255]
inline Hsv to_hsv(double r, double g, double b) noexcept {
  const double high = std::max({r, g, b});
  const double low = std::min({r, g, b});
  const double chroma = high - low;
  if (chroma <= 0.0) return {0.0, 0.0, high / 255.0};
  double sextant = 0.0;
  if (high == r) {
    sextant = (g - b) / chroma;
  } else if (high == g) {
    sextant = 2.0 + (b - r) / chroma;
  } else {
    sextant = 4.0 + (r - g) / chroma;
  }
  const double hue = 60.0 * sextant;
  return {hue < 0.0 ? hue + 360.0 : hue, chroma / high, high / 255.0};
}

}  // namespace breakshot::perception
