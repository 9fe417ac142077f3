#pragma once

#include "common/time.hpp"

#include <chrono>

namespace breakshot::sim_bridge {

/// How the servo drives behave. The arm's own limits - range, speed, torque - come from its description.
struct DriveSettings {
  /// Inertia of each motor's rotor as its joint feels it through the gear, kg m^2. It is most of what an impact meets at the wrist. The value is
  /// that of the UR5e in MuJoCo Menagerie (armature); a URDF has no place for it.
  double rotor_inertia = 0.1;
  /// Position loop, critically damped, rad/s. 150 rad/s (24 Hz) is what collaborative arms are identified with.
  double bandwidth = 150.0;
  /// From set-point to motion: the reference is the set-point of this long ago. Shifts a motion in time and leaves its path alone.
  Duration lag = std::chrono::milliseconds{2};
  /// Of the fastest joint when the drives brake by themselves; the others stop with it, so the arm stays near its path, rad/s^2.
  double brake_deceleration = 15.0;
  /// The drives brake when no command was taken for this long (Universal Robots' client: 20 ms; Franka: 20 packets of 1 ms).
  Duration silence_limit = std::chrono::milliseconds{20};
  /// A `due` further ahead than this is refused.
  Duration horizon = std::chrono::milliseconds{100};
};

}  // namespace breakshot::sim_bridge
