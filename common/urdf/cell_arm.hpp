#pragma once

#include "common/config/cell_config.hpp"
#include "common/urdf/arm_description.hpp"

namespace breakshot {

/// Reads the arm that section `cell` names, and checks its park pose against it: one angle per joint, each within the joint's range.
///
/// @throws ArmDescriptionError as load_arm()
/// @throws ConfigError when the park pose does not fit the arm
ArmDescription load_cell_arm(const CellConfig& cell);

}  // namespace breakshot
