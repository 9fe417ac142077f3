#pragma once

#include "common/geometry.hpp"

#include <array>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace breakshot::sim_bridge {

/// A colour as people write it: sRGB-encoded red, green and blue, each 0 to 1.
using Rgb = std::array<float, 3>;

/// Why no camera can be had, or why a frame could not be rendered, with what to do about it.
class CameraError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One area light (a softbox far away) and the light that comes from everywhere.
struct LightSettings {
  Vector3 towards_W{
      0.45, 0.35,
      1.0};  ///< direction from the table to the light, any length; here the arm, which stands at -x, does not shade the workspace
  double angular_radius = 0.09;  ///< half of the angle under which the softbox appears: how soft its shadows are, rad
  double ambient = 0.45;         ///< share of the light that comes from everywhere, 0 to 1
  bool shadows = true;           ///< cast shadows of discs and arm, and the darkening where a disc meets the table
};

/// A marker printed on the table: squares of black and white.
struct MarkerPrint {
  Vector2 p_WM{0.0, 0.0};   ///< its middle, m
  double yaw = 0.0;         ///< from x of W to the right of the print, rad
  double square = 0.0;      ///< side of one square, m
  int squares = 0;          ///< per side of the print, the white margin included
  std::vector<bool> white;  ///< squares x squares, row by row from the top left
};

/// A rectangular table top around the origin of W, its upper face in z = 0, and the floor below it.
struct TableSettings {
  Vector2 size{1.4, 1.2};           ///< m
  double thickness = 0.04;          ///< m
  double height_over_floor = 0.75;  ///< m
  double texture = 0.5;             ///< 0: one plain colour; 1: clearly speckled (about 3 % of contrast)
  Rgb rgb{0.76F, 0.75F, 0.72F};
  Rgb floor_rgb{0.36F, 0.37F, 0.38F};
  std::vector<MarkerPrint> markers;
};

/// What the light and the sensor's electronics do to the whole image. 1, 1, 1, 1 is the reference.
struct Exposure {
  double brightness = 1.0;                             ///< factor on the light, 0 (dark) to kMaxBrightness
  std::array<double, 3> white_balance{1.0, 1.0, 1.0};  ///< factors on red, green and blue light, each 0 to kMaxBrightness
};
/// Beyond this the sensor's fixed-point arithmetic would overflow; eight times the light saturates everything anyway.
inline constexpr double kMaxBrightness = 8.0;

struct NoiseSettings {
  bool enabled = true;
  /// Variance of a colour value I (0 to 255) is read_sigma^2 + shot_gain * I.
  double read_sigma = 0.8;
  double shot_gain = 0.012;
  /// RMS of the depth is z^2 * depth_subpixel / (depth_focal * depth_baseline): the error of a stereo camera that finds disparities to
  /// depth_subpixel px. The values are those of a D435i (librealsense #3904): 2.4 mm at 0.8 m.
  double depth_subpixel = 0.08;
  double depth_focal = 425.0;     ///< px
  double depth_baseline = 0.050;  ///< m
};

/// How the camera stands otherwise than its calibration says.
struct CameraMove {
  Vector3 by_W{Vector3::Zero()};    ///< m
  Vector3 turn_C{Vector3::Zero()};  ///< rotation vector, rad
};

struct CameraSettings {
  CameraMove move;
  LightSettings light;
  TableSettings table;
  Exposure exposure;
  NoiseSettings noise;
  std::uint64_t seed = 1;   ///< of the noise
  double depth_min = 0.10;  ///< nearer than this there is no measurement, m
  double depth_max = 6.0;   ///< farther than this neither; at most 6.5 (what 16 bits of 0.1 mm hold), m
  /// Colours of the discs; DiscState::colour is an index into it.
  std::vector<Rgb> palette{{0.80F, 0.13F, 0.12F}, {0.16F, 0.55F, 0.22F}, {0.11F, 0.29F, 0.72F},
                           {0.93F, 0.76F, 0.12F}, {0.50F, 0.20F, 0.62F}, {0.92F, 0.45F, 0.08F}};
};

}  // namespace breakshot::sim_bridge
