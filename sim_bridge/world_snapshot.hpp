#pragma once

#include "common/geometry.hpp"
#include "common/time.hpp"

#include <cstdint>
#include <vector>

namespace breakshot::sim_bridge {

/// A disc as it truly is. Leaves the bridge only as pixels, or on sim/truth for tests and scoring.
struct DiscState {
  Vector2 p_WD{0.0, 0.0};     ///< m
  Vector2 v_WD_W{0.0, 0.0};   ///< m/s
  double yaw = 0.0;           ///< rad
  double radius = 0.030;      ///< m
  double height = 0.020;      ///< m
  double mass = 0.1;          ///< kg
  std::uint8_t colour = 0;    ///< index into the colour table of the configuration
  bool on_table = true;       ///< false once it slid over the table's edge
};

/// The world at one instant: all that the camera needs to draw it.
struct WorldSnapshot {
  Time stamp{};
  std::vector<DiscState> discs;
  std::vector<Pose> X_WL;     ///< pose of each moving link, as in ArmDescription::links
};

}  // namespace breakshot::sim_bridge
