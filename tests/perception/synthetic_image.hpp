#pragma once

#include "common/camera_model.hpp"
#include "common/frames.hpp"
#include "common/geometry.hpp"
#include "perception/settings.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::perception::test {

struct SyntheticDisc {
  Vector2 p_WD{0.0, 0.0};
  double radius = 0.030;
  std::uint8_t colour = 0;  ///< index into test_settings().colours
  double lift = 0.0;        ///< of its lower face above the table, m
};

/// A level plate over the table.
struct SyntheticPlate {
  Rect area;
  double height = 0.0;                      ///< m
  Eigen::Vector3d paint{0.35, 0.36, 0.37};  ///< linear reflectance
};

/// A second, much simpler renderer than the simulator's: analytic ray casting with exact pixel coverage, so that an error common to the
/// simulator's camera and to perception shows.
struct SyntheticScene {
  std::vector<SyntheticDisc> discs;
  std::vector<SyntheticPlate> plates;  ///< the first one that a ray meets is seen, so list the highest first
  std::optional<Rect> arm;             ///< a grey plate at arm_height
  double arm_height = 0.25;            ///< m
  double brightness = 1.0;             ///< factor on the light
  double light_azimuth = 0.7;          ///< rad: where the walls are brightest
  double noise = 2.0;                  ///< standard deviation per channel, of 255
  double blur = 0.6;                   ///< standard deviation of the lens's blur, px
};

struct SyntheticFrames {
  ColorFrame color;
  DepthFrame depth;
};

/// The camera of the cell: 0.8 m up, looking straight down, a D435i's focal length. `bent` adds distortion and a tilt of two degrees.
CameraModel test_camera(bool bent = false);
/// Eight colours around the hue circle.
PerceptionSettings test_settings();
/// The frames of one instant. seq is their number, seeds the noise, and counts the time at 30 Hz.
SyntheticFrames render(const SyntheticScene& scene, const CameraModel& camera, std::uint64_t seq);

/// n discs without overlap, centres within `area`, any two at least `min_gap` apart; colours differ as long as there are enough.
std::vector<SyntheticDisc> random_discs(std::uint32_t seed, int n, const Rect& area, double min_gap, double radius_min, double radius_max);

/// n discs of which each touches at least one other, in as many colours.
std::vector<SyntheticDisc> touching_discs(std::uint32_t seed, int n, const Rect& area, double radius_min, double radius_max, int colours);

}  // namespace breakshot::perception::test
