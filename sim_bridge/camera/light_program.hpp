#pragma once

#include "sim_bridge/camera/gl_objects.hpp"
#include "sim_bridge/camera/light.hpp"

#include <string>

namespace breakshot::sim_bridge {

// What makes the shaders of shaders.hpp those of one light. llvmpipe runs both sides of every branch, so what does not change from frame to
// frame is settled before the shaders are compiled.

/// The definitions that stand before shaders::kLight.
std::string light_definitions(const Light& light, const ShineSettings& shine);

/// Sets the uniforms of shaders::kLight and kDiscFragment in a program, which it leaves in use.
void set_light(const Program& program, const Light& light, const ShineSettings& shine);

}  // namespace breakshot::sim_bridge
