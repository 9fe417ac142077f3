#pragma once

#include "common/time.hpp"

#include <cstdint>
#include <vector>

namespace breakshot {

/// A colour image of the camera, RGB, row-major, top left first. Travels on `cell/color`.
struct ColorFrame {
  std::uint64_t seq = 0;
  Time exposed{};
  int width = 0, height = 0;      ///< px
  std::vector<std::uint8_t> rgb;  ///< 3 * width * height
};

/// The depth image registered to the colour image of the same seq. Travels on `cell/depth`.
struct DepthFrame {
  std::uint64_t seq = 0;
  Time exposed{};
  int width = 0, height = 0;         ///< px
  std::vector<std::uint16_t> depth;  ///< width * height, along the optical axis, unit 0.1 mm, 0: no measurement
};

}  // namespace breakshot
