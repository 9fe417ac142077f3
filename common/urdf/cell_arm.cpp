#include "common/urdf/cell_arm.hpp"

#include <numbers>
#include <string>

namespace breakshot {
namespace {

std::string degrees(double angle) { return std::to_string(angle * 180.0 / std::numbers::pi); }

}  // namespace

ArmDescription load_cell_arm(const CellConfig& cell) {
  ArmDescription arm = load_arm(cell.arm.urdf, cell.arm.base_link, cell.arm.tip_link);
  const std::string key = "cell.arm.park_deg";
  const auto joints = static_cast<Eigen::Index>(arm.joints.size());
  if (cell.arm.park.size() != joints) {
    throw ConfigError{key + ": found " + std::to_string(cell.arm.park.size()) + " angles; allowed: " + std::to_string(joints) +
                      ", one per joint of " + cell.arm.urdf.string()};
  }
  for (Eigen::Index i = 0; i < joints; ++i) {
    const JointDescription& joint = arm.joints[static_cast<std::size_t>(i)];
    const double angle = cell.arm.park[i];
    if (!(angle >= joint.lower && angle <= joint.upper)) {
      throw ConfigError{key + "[" + std::to_string(i) + "]: found " + degrees(angle) + " deg; allowed: [" + degrees(joint.lower) + ", " +
                        degrees(joint.upper) + "] deg, the range of " + joint.name + " in " + cell.arm.urdf.string()};
    }
  }
  return arm;
}

}  // namespace breakshot
