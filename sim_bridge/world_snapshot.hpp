#pragma once

#include "common/geometry.hpp"
#include "common/sim_interface.hpp"
#include "common/time.hpp"

#include <vector>

namespace breakshot::sim_bridge {

/// Leaves the bridge only as pixels, or on sim/truth for tests and scoring.
using DiscState = SimDisc;

/// The world at one instant: all that the camera needs to draw it.
struct WorldSnapshot {
  Time stamp{};
  std::vector<DiscState> discs;
  std::vector<Pose> X_WL;  ///< pose of each moving link, as in ArmDescription::links
};

}  // namespace breakshot::sim_bridge
