#pragma once

#include "common/joints.hpp"
#include "common/urdf/arm_description.hpp"

namespace breakshot::sim_bridge {

/// The UR5e of the cell without its file: published kinematics, masses and centres of mass, drives' torques, striker.
ArmDescription cell_arm();
/// Its base in the cell.
Pose cell_base();
/// Joint angles that put the striker's tip at p_W, pointing straight down, elbow up. Fails the test when there are none.
JointVector pose_over(const Vector3& p_WT);

}  // namespace breakshot::sim_bridge
