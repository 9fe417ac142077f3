#pragma once

#include "common/geometry.hpp"

#include <array>
#include <cstddef>
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

/// Most lamps over the table.
inline constexpr std::size_t kMaxLamps = 4;
/// Of a lamp that counts as white unless the camera is balanced for another one, K.
inline constexpr double kWhiteKelvin = 6500.0;

/// An area light far away (a softbox, a window).
struct LampSettings {
  /// Direction from the table to the lamp, any length; here the arm, which stands at -x, does not shade the workspace.
  Vector3 towards_W{0.45, 0.35, 1.0};
  double angular_radius = 0.09;  ///< half of the angle under which it appears: how soft its shadows and how wide its highlights are, rad
  double share = 1.0;            ///< of the lamps' light, against the shares of the others
  double kelvin = kWhiteKelvin;  ///< colour temperature
};

/// Up to kMaxLamps lamps, and the light that comes from everywhere.
struct LightSettings {
  LightSettings();  ///< one lamp

  std::vector<LampSettings> lamps;
  double ambient = 0.45;                  ///< share of the light that comes from everywhere, 0 to 1
  double ambient_kelvin = kWhiteKelvin;   ///< its colour temperature
  double balanced_kelvin = kWhiteKelvin;  ///< light of this temperature is white to the camera
  bool shadows = true;                    ///< cast shadows of discs and arm, and the darkening where a disc meets the table
};

/// Highlights on the discs: Blinn and Phong's, widened by the lamp's size. 0: matt.
struct ShineSettings {
  double strength = 0.0;  ///< at the highlight's middle, against the light that a white surface scatters
  double gloss = 60.0;    ///< Blinn's exponent: how sharp a point lamp's highlight is
};

/// What changes with the world's time.
struct DriftSettings {
  double brightness_ramp = 1.0;        ///< brightness goes to this factor and back, again and again; 1: it stays
  double brightness_ramp_time = 10.0;  ///< for one way, s
  double white_balance = 0.0;          ///< red and blue swing by up to this share, each on its own; 0: they stay
  double white_balance_period = 60.0;  ///< s
};

/// The shadow of someone or something between the lamps and the table: a band with soft edges that wanders over the table and back.
struct MovingShadowSettings {
  double depth = 0.0;      ///< share of the lamps' light that it takes; 0: there is none
  double width = 0.30;     ///< of the darkest part, m
  double edge = 0.10;      ///< from full light to full shadow, on each side, m
  double speed = 0.20;     ///< m/s
  double direction = 1.0;  ///< of its way, from W's x axis, rad
};

/// What stereo makes of depth beside its noise. Registered to the colour image, as all depth here.
struct DepthFlawSettings {
  bool shadow = false;  ///< no depth where the second camera of the pair sees something nearer: left of whatever stands up
  double holes = 0.0;   ///< share of the places along a rim at which the match fails
  double bleed = 0.0;   ///< a rim reaches up to so far over what lies behind it, px
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
  ShineSettings shine;
  DriftSettings drift;
  MovingShadowSettings moving_shadow;
  DepthFlawSettings depth_flaws;
  double exposure_time = 0.0;  ///< how long the shutter is open about the stamp: motion blur, s; 0: an instant
  std::uint64_t seed = 1;      ///< of noise, drift, moving shadow and flaws
  double depth_min = 0.10;     ///< nearer than this there is no measurement, m
  double depth_max = 6.0;      ///< farther than this neither; at most 6.5 (what 16 bits of 0.1 mm hold), m
  /// Colours of the discs; DiscState::colour is an index into it.
  std::vector<Rgb> palette{{0.80F, 0.13F, 0.12F}, {0.16F, 0.55F, 0.22F}, {0.11F, 0.29F, 0.72F},
                           {0.93F, 0.76F, 0.12F}, {0.50F, 0.20F, 0.62F}, {0.92F, 0.45F, 0.08F}};
};

}  // namespace breakshot::sim_bridge
