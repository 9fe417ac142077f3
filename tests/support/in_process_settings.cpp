#include "common/config/camera_file.hpp"
#include "common/urdf/arm_description.hpp"
#include "controller/controller_config.hpp"
#include "perception/perception_config.hpp"
#include "tests/support/in_process_cell.hpp"

namespace breakshot::support {

InProcessSettings load_in_process_settings(const std::string& config_file, const std::vector<std::string>& overrides) {
  const ConfigDocument document = load_cell_document(config_file, overrides);
  InProcessSettings settings;
  settings.cell = load_cell_config(document);
  const CellConfig& cell = settings.cell;
  settings.arm = load_arm(cell.arm.urdf, cell.arm.base_link, cell.arm.tip_link);
  settings.camera_model = load_camera(cell.camera_file);

  const auto controller = control::load_controller_config(document, cell);
  settings.motion = controller.motion;
  settings.loop = controller.loop;
  settings.loop.limits = control::joint_limits(settings.arm, controller.loop.stop);
  settings.perception = perception::load_perception_config(document, cell).settings;

  settings.sim.X_WB = cell.arm.X_WB;
  settings.sim.q_start = cell.arm.park;
  settings.camera.palette.clear();
  for (const auto& c : cell.colours) settings.camera.palette.push_back({static_cast<float>(c.rgb[0]) / 255.0F, static_cast<float>(c.rgb[1]) / 255.0F, static_cast<float>(c.rgb[2]) / 255.0F});
  settings.frame_period = std::chrono::microseconds{33'333};
  settings.camera_latency = std::chrono::milliseconds{66};
  return settings;
}

}  // namespace breakshot::support
