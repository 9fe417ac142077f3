#include "sim_bridge/camera/light_program.hpp"

namespace breakshot::sim_bridge {
namespace {

void set_amount(const Program& program, const std::string& name, const Vector3& amount, bool coloured) {
  if (coloured) {
    program.set(name.c_str(), amount);
  } else {
    program.set(name.c_str(), amount.y());
  }
}

/// Name of an array's item.
std::string item(const char* array, std::size_t i) { return std::string{array}.append("[").append(std::to_string(i)).append("]"); }

/// Strength and exponent of a lamp's highlight. A lamp that is not a point makes it wider and weaker: the variances of lobe and lamp add up, the
/// lamp's being a quarter of its radius squared, and another quarter because the half vector turns by half the angle.
Vector2 highlight(const ShineSettings& shine, const Lamp& lamp) {
  const double exponent = 1.0 / (1.0 / shine.gloss + lamp.angular_radius * lamp.angular_radius / 16.0);
  return {shine.strength * exponent / shine.gloss, exponent};
}

}  // namespace

std::string light_definitions(const Light& light, const ShineSettings& shine) {
  return "#define LAMPS " + std::to_string(light.lamps.size()) + "\n#define LIGHT " + (light.coloured ? "vec3" : "float") +
         "\n#define SHINE " + (shine.strength > 0.0 ? "1" : "0") + "\n";
}

void set_light(const Program& program, const Light& light, const ShineSettings& shine) {
  program.use();
  set_amount(program, "ambient", light.ambient, light.coloured);
  for (std::size_t i = 0; i < light.lamps.size(); ++i) {
    const Lamp& lamp = light.lamps[i];
    program.set(item("light_W", i).c_str(), lamp.direction_W);
    program.set(item("tan_softness", i).c_str(), lamp.tan_softness);
    set_amount(program, item("level", i), lamp.level, light.coloured);
    program.set(item("shine", i).c_str(), highlight(shine, lamp));
  }
}

}  // namespace breakshot::sim_bridge
