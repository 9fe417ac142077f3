#pragma once

#include "common/urdf/arm_description.hpp"
#include "controller/kinematics/arm_kinematics.hpp"

#include <vector>

namespace breakshot::motion {

/// How high the arm is above the table.
class ArmClearance {
 public:
  /// Keeps a pointer to the kinematics, which must outlive it. A link counts by its collision shapes and its frame's origin.
  ArmClearance(const ArmDescription& arm, const kinematics::ArmKinematics& kinematics, double striker_radius);

  struct Heights {
    double tip;  ///< lowest point of the striker's lower face, m above the table
    /// Lowest point of the links, m. Not counted: the first link, whose height never changes, and the striker, whose lowest point is `tip`.
    double links;
  };
  /// No allocation, about 1 us.
  Heights heights(const JointVector& q) const noexcept;

 private:
  struct Body {
    std::size_t link;
    Shape shape;
  };
  const kinematics::ArmKinematics* kinematics_;
  double striker_radius_;
  std::vector<Body> bodies_;
};

}  // namespace breakshot::motion
