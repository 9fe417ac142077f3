#pragma once

#include "common/geometry.hpp"

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <array>
#include <cstdint>
#include <optional>

namespace breakshot::perception {

/// Light in red, green and blue, [0, 255].
using RgbLight = Eigen::Vector3f;

/// What ends at a rim.
enum class Rim : std::uint8_t {
  kTop,         ///< the top face, before whatever lies beyond and below it
  kFoot,        ///< the wall, on the table
  kNarrowFoot,  ///< a wall so narrow that a line across its foot starts on the top face, which is brighter
};

/// The light along a line across a rim, by bilinear interpolation.
class RimLine {
 public:
  /// Both are kept by reference.
  /// @param light    of an encoded value, [0, 255]
  /// @param origin   a place close to the rim, px
  /// @param outward  unit vector in the image, away from the disc
  RimLine(const cv::Mat3b& rgb, const std::array<float, 256>& light, const Vector2& origin, const Vector2& outward) noexcept
      : rgb_{rgb}, light_{light}, origin_{origin}, outward_{outward} {}

  /// @param distance  from the origin, outwards, px; the place must lie within the image
  RgbLight at(double distance) const noexcept;

 private:
  const cv::Mat3b& rgb_;
  const std::array<float, 256>& light_;
  Vector2 origin_, outward_;
};

/// Where a line crosses a rim.
struct RimEdge {
  double at = 0.0;     ///< from the line's origin, outwards, px
  double trust = 1.0;  ///< weight by how plain the two sides are: less where the disc's hue is not the same all over, or its light clipped
};

/// How far from the origin measure_edge() looks, px.
inline constexpr double kExactReach = 2.5;
inline constexpr double kMaxReach = 3.5;

/// Where the colour passes half-way from what it is at one end of the line to what it is at the other; nothing where it does not, or where the
/// two differ too little, or where a narrow wall is not told from what lies beyond by hue. Good to a quarter of a pixel.
/// @param reach  half of the line's length, px, at most kMaxReach
/// @param level  of the light: 1 for the reference, less when there is less
std::optional<RimEdge> find_edge(const RimLine& line, Rim rim, double reach, float level) noexcept;

/// The same for an origin within 0.3 px of the edge, far better: the edge is where the integral of what one side adds to the colours says, with
/// that side's light taken on to the edge along its own slope, and what the other side's hue drifts by taken off. Of the two sides the one is taken that neither shade nor bevel bends there: what lies
/// beyond a top face, the wall before its foot. So lamps from one side hardly shift it.
std::optional<RimEdge> measure_edge(const RimLine& line, Rim rim, float level) noexcept;

}  // namespace breakshot::perception
