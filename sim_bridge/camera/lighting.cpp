#include "sim_bridge/camera/lighting.hpp"

#include "common/config/config_node.hpp"
#include "common/config/named_file.hpp"
#include "sim_bridge/camera/camera_config.hpp"

namespace breakshot::sim_bridge {

std::vector<std::string> lighting_names(const std::filesystem::path& folder) { return file_names(folder, "lighting"); }

void apply_lighting(const std::filesystem::path& folder, std::string_view name, CameraSettings& settings) {
  const ConfigDocument document = ConfigDocument::load(named_file(folder, "lighting", name));
  const ConfigNode node = document.section("lighting");
  (void)node.text("description");
  CameraSettings changed = settings;
  read_picture(node, PictureKeys::kAny, changed);
  document.root().finish();
  settings = changed;
}

}  // namespace breakshot::sim_bridge
