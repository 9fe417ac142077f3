#pragma once

#include "common/urdf/arm_description.hpp"

namespace breakshot::support {

/// Arms for tests of kinematics, by published figures; all but the first are files in tests/support/arms/. Links have masses and no shapes: only
/// kinematics and limits matter.

/// UR5e with the cell's striker: Denavit-Hartenberg figures and ranges that Universal Robots publishes, striker 0.2 m beyond the flange.
ArmDescription ur5e();
/// Franka Panda with its flange as tip: seven joints (frankaemika.github.io/docs/control_parameters.html).
ArmDescription panda();
/// ABB IRB 2400/10 with a 0.2 m tool: six joints with a spherical wrist (product specification 3HAC 9112-1).
ArmDescription irb2400();
/// uFactory xArm7 (ufactory xarm_ros description): seven joints.
ArmDescription xarm7();

}  // namespace breakshot::support
