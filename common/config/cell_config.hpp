#pragma once

#include "common/config/config_node.hpp"
#include "common/geometry.hpp"
#include "common/joints.hpp"
#include "common/table_markers.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot {

/// The part of the HSV cone that counts as one colour. Closed ranges.
struct HsvRange {
  double hue_min = 0.0, hue_max = 360.0;  ///< deg in [0, 360]; hue_min > hue_max wraps through 0 (red)
  double saturation_min = 0.0, saturation_max = 1.0;
  double value_min = 0.0, value_max = 1.0;

  bool contains(double hue_deg, double saturation, double value) const noexcept;
};

/// A colour that discs may have. What the simulator paints and what perception looks for are separate on purpose: real paint under real
/// light is not its nominal RGB either.
struct Colour {
  std::string name;                 ///< unique in the table
  std::array<std::uint8_t, 3> rgb;  ///< paint, sRGB
  HsvRange hsv;                     ///< of its pixels, wide enough for shading and noise
};

/// Most colours in the table. A colour's index in it is what SceneDisc::colour holds.
inline constexpr std::size_t kMaxColours = 32;

enum class CellMode : std::uint8_t {
  kRealTime,  ///< the simulator runs at wall speed, stamps are CLOCK_MONOTONIC
  kLockstep,  ///< the simulator waits for the controller tick by tick; independent of the machine's load
};

/// DDS domain ids, [0, 232], all different (RTPS 2.3, 9.6.1.1: port numbers end there).
struct DdsDomains {
  int cell = 31;  ///< joint states, images, scene, strokes, tasks
  int mes = 32;   ///< the factory's side of the gateway
  int ros2 = 0;   ///< standard ROS 2 types, when asked for; 0 is ROS_DOMAIN_ID's default
};

/// Where the arm stands and what it is.
struct CellArm {
  std::filesystem::path urdf;
  std::string base_link;
  std::string tip_link;  ///< frame T: z along the rod, away from the flange
  Pose X_WB{Pose::Identity()};
  JointVector park;  ///< joint pose at rest, in which the arm hides nothing of the workspace from the camera, rad
};

/// Section `cell` of the configuration: what several processes must agree on.
struct CellConfig {
  CellMode mode = CellMode::kRealTime;
  Rect workspace;                ///< every disc's centre is to rest in it, in W, m
  Vector2 table_size{0.0, 0.0};  ///< of the table top, centred on W's origin, m
  double target_gap = 0.0;       ///< G: default for orders, m
  double striker_radius = 0.0;   ///< m
  double tip_height = 0.0;       ///< of the striker's lower face above the table while it strokes, m
  double disc_height = 0.0;      ///< m
  double disc_radius_min = 0.0;  ///< of the discs that may lie on the table, m
  double disc_radius_max = 0.0;  ///< m
  std::vector<Colour> colours;
  DdsDomains dds;
  CellArm arm;
  TableMarkers table_markers;
  std::filesystem::path camera_file;       ///< see common/config/camera_file.hpp
  std::filesystem::path formation_folder;  ///< see common/config/formation.hpp
};

/// Every section that a cell configuration may have.
inline constexpr std::array<std::string_view, 8> kCellSections{"cell",    "sim_bridge",  "controller",  "perception",
                                                               "planner", "mes_gateway", "ros_gateway", "launcher"};

/// Reads a cell configuration with the overrides of the command line and refuses unknown sections. A process then reads its sections.
/// @throws ConfigError
ConfigDocument load_cell_document(const std::filesystem::path& file, std::span<const std::string> overrides = {});

/// Reads section `cell` whole and checks it across its keys.
/// @throws ConfigError
CellConfig load_cell_config(const ConfigDocument& document);

/// Index of a colour's name in the table; nothing when it is not there.
std::optional<std::uint8_t> find_colour(std::span<const Colour> colours, std::string_view name) noexcept;
/// The names of the table, for error messages: "red, amber, ...".
std::string colour_names(std::span<const Colour> colours);

/// "real_time" or "lockstep".
const char* to_string(CellMode mode) noexcept;

}  // namespace breakshot
