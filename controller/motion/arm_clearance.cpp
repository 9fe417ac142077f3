#include "controller/motion/arm_clearance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace breakshot::motion {
namespace {

double lowest(const Shape& shape, const Pose& X_WS) noexcept {
  const Eigen::RowVector3d up = X_WS.linear().row(2);  // the shape's axes, seen along z_W
  double below = 0.0;
  switch (shape.kind) {
    case Shape::Kind::kBox: below = 0.5 * up.cwiseAbs().dot(shape.size); break;
    case Shape::Kind::kCylinder:
      below = 0.5 * shape.size.y() * std::abs(up.z()) + shape.size.x() * std::sqrt(std::max(0.0, 1.0 - up.z() * up.z()));
      break;
    case Shape::Kind::kSphere: below = shape.size.x(); break;
  }
  return X_WS.translation().z() - below;
}

}  // namespace

ArmClearance::ArmClearance(const ArmDescription& arm, const kinematics::ArmKinematics& kinematics, double striker_radius)
    : kinematics_{&kinematics}, striker_radius_{striker_radius} {
  for (std::size_t link = 1; link + 1 < arm.links.size(); ++link) {
    for (const Shape& shape : arm.links[link].collisions) bodies_.push_back({link, shape});
  }
}

ArmClearance::Heights ArmClearance::heights(const JointVector& q) const noexcept {
  std::array<Pose, kMaxJoints> X_WL;
  const Pose X_WT = kinematics_->links_in_world(q, X_WL);
  const double upright = X_WT.linear()(2, 2);
  Heights heights{X_WT.translation().z() - striker_radius_ * std::sqrt(std::max(0.0, 1.0 - upright * upright)), X_WL[1].translation().z()};
  for (std::size_t link = 2; link < static_cast<std::size_t>(kinematics_->joints()); ++link) {
    heights.links = std::min(heights.links, X_WL[link].translation().z());
  }
  for (const Body& body : bodies_) heights.links = std::min(heights.links, lowest(body.shape, X_WL[body.link] * body.shape.X_LS));
  return heights;
}

}  // namespace breakshot::motion
