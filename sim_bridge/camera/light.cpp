#include "sim_bridge/camera/light.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace breakshot::sim_bridge {
namespace {

/// Where the sensor's red, green and blue answer most, m.
const Vector3 kWavelengths{600e-9, 540e-9, 460e-9};
/// Planck's second radiation constant, h c / k (CODATA 2018), m K.
constexpr double kSecondRadiation = 1.438776877e-2;

/// Spectral radiance at the three wavelengths, up to a factor that is the same for all temperatures.
Vector3 radiance(double kelvin) {
  return kWavelengths.unaryExpr([kelvin](double wavelength) { return 1.0 / std::expm1(kSecondRadiation / (wavelength * kelvin)); });
}

void check_range(const std::string& what, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw CameraError{"camera: " + what + ": found " + std::to_string(value) + "; allowed " + std::to_string(low) + " to " +
                      std::to_string(high)};
  }
}

Lamp make_lamp(const LampSettings& settings) {
  const double elevation = std::atan2(settings.towards_W.z(), settings.towards_W.head<2>().norm());
  if (!settings.towards_W.allFinite() || !(elevation > 0.17)) {
    throw CameraError{"camera: light.lamps.towards_W must point at least 10 degrees above the table"};
  }
  check_range("light.lamps.angular_radius in rad", settings.angular_radius, 0.0, 0.5);
  check_range("light.lamps.share", settings.share, 1e-3, 1e3);
  check_range("light.lamps.kelvin", settings.kelvin, 1000.0, 40000.0);
  Lamp lamp;
  lamp.direction_W = settings.towards_W.normalized();
  lamp.angular_radius = settings.angular_radius;
  lamp.tan_softness = std::tan(settings.angular_radius);
  const Vector3 across = lamp.direction_W.unitOrthogonal();
  lamp.axes_W << across, lamp.direction_W.cross(across), lamp.direction_W;
  return lamp;
}

}  // namespace

// Not in the header: inlined into an aggregate's construction, GCC 12 takes the vector for uninitialised.
LightSettings::LightSettings() : lamps(1) {}

Vector3 black_body(double kelvin, double balanced_kelvin) {
  const Vector3 colour = radiance(kelvin).cwiseQuotient(radiance(balanced_kelvin));
  return colour / colour.y();
}

Light::Light(const LightSettings& settings) : coloured{false}, shadows{settings.shadows} {
  if (settings.lamps.empty() || settings.lamps.size() > kMaxLamps) {
    throw CameraError{"camera: light.lamps: found " + std::to_string(settings.lamps.size()) + "; allowed 1 to " +
                      std::to_string(kMaxLamps)};
  }
  check_range("light.ambient", settings.ambient, 0.0, 1.0);
  check_range("light.ambient_kelvin", settings.ambient_kelvin, 1000.0, 40000.0);
  check_range("light.balanced_kelvin", settings.balanced_kelvin, 1000.0, 40000.0);
  ambient = settings.ambient * black_body(settings.ambient_kelvin, settings.balanced_kelvin);
  coloured = settings.ambient_kelvin != settings.balanced_kelvin;
  double shares = 0.0;
  for (const LampSettings& lamp : settings.lamps) {
    lamps.push_back(make_lamp(lamp));
    shares += lamp.share;
  }
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const LampSettings& lamp = settings.lamps[i];
    lamps[i].level = (1.0 - settings.ambient) * lamp.share / shares * black_body(lamp.kelvin, settings.balanced_kelvin);
    coloured = coloured || lamp.kelvin != settings.balanced_kelvin;
  }
}

}  // namespace breakshot::sim_bridge
