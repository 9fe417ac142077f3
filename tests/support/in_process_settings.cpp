#include "common/config/camera_file.hpp"
#include "common/urdf/arm_description.hpp"
#include "controller/controller_config.hpp"
#include "perception/perception_config.hpp"
#include "planner/planner_config.hpp"
#include "sim_bridge/sim_bridge_config.hpp"
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

  const auto bridge = sim_bridge::load_sim_bridge_config(document, cell);
  settings.sim = bridge.sim;
  settings.camera = bridge.camera;
  settings.disc_mass = bridge.disc_mass;
  settings.disc_mass_radius = bridge.disc_mass_radius;
  settings.frame_period = bridge.frame_period;
  settings.camera_latency = bridge.camera_latency;

  const auto planner = planner::load_planner_config(document, cell);
  settings.strategy = planner.settings;
  settings.task = planner.task;
  settings.estimate = planner.estimate;
  settings.learn = planner.learn;
  settings.ask_arm = planner.ask_arm;
  return settings;
}

}  // namespace breakshot::support
