#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "common/config/formation.hpp"
#include "common/sim_interface.hpp"
#include "common/time.hpp"
#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/world/sim_world.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace breakshot::sim_bridge {

/// Everything that the process `breakshot-sim_bridge` reads from the configuration: the truth of the simulated cell.
struct SimBridgeConfig {
  SimSettings sim;
  CameraSettings camera;
  Duration frame_period{};
  Duration camera_latency{};              ///< from exposure to the frame on its topic
  Duration camera_jitter{};               ///< more or less, from frame to frame
  std::filesystem::path lighting_folder;  ///< of the presets that apply_lighting() knows
  std::string formation;                  ///< on the table at the start
  double disc_mass = 0.1;                 ///< of a disc of disc_mass_radius; others by their area, kg
  double disc_mass_radius = 0.030;
  double gap_jitter = 0.0;     ///< largest gap that the contacts of a formation are opened to, m
  std::uint64_t gap_seed = 1;  ///< of those gaps
  int priority = 70;           ///< SCHED_FIFO of the physics thread in real-time mode
};

/// Reads the section `sim_bridge` whole and takes the rest from `cell`.
/// @throws ConfigError
SimBridgeConfig load_sim_bridge_config(const ConfigDocument& document, const CellConfig& cell);

/// The discs of a formation with what only the truth knows of them: mass, height, and the gaps of their contacts.
std::vector<SimDisc> discs_of(const Formation& formation, const SimBridgeConfig& config, const CellConfig& cell);

}  // namespace breakshot::sim_bridge
