// The reader of camera files: any text gives a camera that the cell can work with, which its own writer and reader keep, or a ConfigError.

#include "common/config/camera_file.hpp"
#include "common/config/config_node.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

using namespace breakshot;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  CameraModel camera;
  try {
    camera = parse_camera({reinterpret_cast<const char*>(data), size}, "fuzz.yaml");
  } catch (const ConfigError&) {
    return 0;
  }
  const auto middle = camera.point_on_plane({0.5 * camera.width, 0.5 * camera.height}, 0.0);
  if (!middle.allFinite()) std::abort();
  const CameraModel again = parse_camera(camera_text(camera, "again"), "again.yaml");
  if (std::abs(again.fx - camera.fx) > 1e-6 || !again.X_WC.isApprox(camera.X_WC, 1e-7)) std::abort();
  return 0;
}
