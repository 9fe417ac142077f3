#pragma once

#include "common/geometry.hpp"
#include "sim_bridge/camera/camera_settings.hpp"

#include <cstddef>
#include <vector>

namespace breakshot::sim_bridge {

/// Red, green and blue of a black body's light for a camera that is balanced for another one, green being 1.
///
/// By Planck's law at one wavelength per channel, where the sensor's answer peaks (600, 540 and 460 nm): what a camera's channels see, which
/// overlap less than the eye's.
/// @param kelvin, balanced_kelvin  colour temperatures, K
Vector3 black_body(double kelvin, double balanced_kelvin);

/// A lamp, with the axes in which its rays are vertical.
struct Lamp {
  Vector3 direction_W;    ///< unit vector towards it
  Matrix3 axes_W;         ///< columns: two unit vectors across, and direction_W
  double tan_softness;    ///< tangent of the angular radius
  double angular_radius;  ///< rad
  Vector3 level;          ///< red, green and blue of its light on a level surface in the middle of the table
};

/// All light of the scene. A level white surface in the middle of the table has 1, for lamps and surroundings that are white to the camera.
struct Light {
  /// @throws CameraError when a setting is out of its range
  explicit Light(const LightSettings& settings);

  std::vector<Lamp> lamps;
  Vector3 ambient;  ///< red, green and blue of the light from everywhere
  bool coloured;    ///< some of the light is not white
  bool shadows;
};

}  // namespace breakshot::sim_bridge
