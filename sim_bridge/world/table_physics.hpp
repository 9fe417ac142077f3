#pragma once

#include "common/geometry.hpp"

#include <cstdint>

namespace breakshot::sim_bridge {

/// What table, discs and striker are made of. The truth of the simulator: the planner's prior knowledge is another section of the configuration.
struct TablePhysics {
  Rect table{{-0.7, -0.6}, {0.7, 0.6}};  ///< a disc whose centre leaves it falls, m
  double friction = 0.25;                ///< mu between disc and table
  double friction_spread = 0.0;          ///< mu varies smoothly over the table by up to this share, 0 to 0.5
  std::uint64_t friction_seed = 1;       ///< of that variation
  double restitution = 0.8;              ///< e between two discs
  double striker_restitution = 0.8;      ///< e between striker and disc
  /// Slower impacts are plastic: e falls to 0 at low speed in every real material.
  double bounce_speed = 0.01;  ///< between two discs, m/s
  /// Of the striker's. Above the speed of a push, so that the rod stays at the disc that it pushes; below that of a hit. m/s
  double striker_bounce_speed = 0.2;
  double contact_friction = 0.0;  ///< mu at the rims, disc-disc and disc-striker; the paper's equations assume 0
  double striker_radius = 0.010;  ///< m
  /// How long two discs (or striker and disc) stay in touch in an impact, s: contacts are then springs with dampers, integrated in time, and discs that
  /// touch are loaded at the same time. 0: impacts are instants, solved by ODE one layer after the other. Real discs: 0.1 to 0.4 ms.
  double contact_time = 0.0;
};

}  // namespace breakshot::sim_bridge
