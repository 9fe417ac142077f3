#pragma once

#include "common/geometry.hpp"
#include "common/sim_interface.hpp"
#include "common/time.hpp"

#include <vector>

namespace breakshot::sim_bridge {

/// Leaves the bridge only as pixels, or on sim/truth for tests and scoring.
using DiscState = SimDisc;

/// How a link moves.
struct LinkVelocity {
  Vector3 w_WL_W{Vector3::Zero()};  ///< rad/s
  Vector3 v_WL_W{Vector3::Zero()};  ///< of the link's origin, m/s
};

/// The world at one instant: all that the camera needs to draw it.
struct WorldSnapshot {
  Time stamp{};
  std::vector<DiscState> discs;
  std::vector<Pose> X_WL;          ///< pose of each moving link, as in ArmDescription::links
  std::vector<LinkVelocity> V_WL;  ///< how each moves; empty: the arm stands still
};

}  // namespace breakshot::sim_bridge
