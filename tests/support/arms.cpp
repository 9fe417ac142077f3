#include "tests/support/arms.hpp"

#include <numbers>
#include <string>

namespace breakshot::support {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;

Pose pose(const Vector3& p, double roll = 0.0, double pitch = 0.0, double yaw = 0.0) {
  Pose X = Pose::Identity();
  X.translation() = p;
  X.linear() =
      (Eigen::AngleAxisd{yaw, Vector3::UnitZ()} * Eigen::AngleAxisd{pitch, Vector3::UnitY()} * Eigen::AngleAxisd{roll, Vector3::UnitX()})
          .toRotationMatrix();
  return X;
}

void add_joint(ArmDescription& arm, const Pose& X_PL, const Vector3& axis, double lower, double upper, double max_speed) {
  const std::string number = std::to_string(arm.joints.size() + 1);
  arm.joints.push_back({"joint_" + number, X_PL, axis, lower, upper, max_speed, 100.0});
  LinkDescription link;
  link.name = "link_" + number;
  link.mass = 1.0;
  link.I_Com_L = 0.01 * Matrix3::Identity();
  arm.links.push_back(link);
}

}  // namespace

ArmDescription ur5e() {
  ArmDescription arm;
  arm.name = "ur5e";
  const Vector3 z = Vector3::UnitZ();
  const double full = 2.0 * kPi;
  // Link i's frame after the standard DH step of joint i-1: Tz(d) Tx(a) Rx(alpha).
  add_joint(arm, pose({0, 0, 0}), z, -full, full, kPi);
  add_joint(arm, pose({0, 0, 0.1625}, kPi / 2), z, -full, full, kPi);
  add_joint(arm, pose({-0.425, 0, 0}), z, -kPi, kPi, kPi);
  add_joint(arm, pose({-0.3922, 0, 0}), z, -full, full, kPi);
  add_joint(arm, pose({0, 0, 0.1333}, kPi / 2), z, -full, full, kPi);
  add_joint(arm, pose({0, 0, 0.0997}, -kPi / 2), z, -full, full, kPi);
  arm.X_LT = pose({0, 0, 0.0996 + 0.2});
  return arm;
}

ArmDescription panda() {
  ArmDescription arm;
  arm.name = "panda";
  const Vector3 z = Vector3::UnitZ();
  // Craig's DH: Rx(alpha) Tx(a) Tz(d), which is one fixed step here.
  add_joint(arm, pose({0, 0, 0.333}), z, -2.8973, 2.8973, 2.175);
  add_joint(arm, pose({0, 0, 0}, -kPi / 2), z, -1.7628, 1.7628, 2.175);
  add_joint(arm, pose({0, -0.316, 0}, kPi / 2), z, -2.8973, 2.8973, 2.175);
  add_joint(arm, pose({0.0825, 0, 0}, kPi / 2), z, -3.0718, -0.0698, 2.175);
  add_joint(arm, pose({-0.0825, 0.384, 0}, -kPi / 2), z, -2.8973, 2.8973, 2.61);
  add_joint(arm, pose({0, 0, 0}, kPi / 2), z, -0.0175, 3.7525, 2.61);
  add_joint(arm, pose({0.088, 0, 0}, kPi / 2), z, -2.8973, 2.8973, 2.61);
  arm.X_LT = pose({0, 0, 0.107});
  return arm;
}

ArmDescription irb2400() {
  ArmDescription arm;
  arm.name = "irb2400";
  const Vector3 x = Vector3::UnitX();
  const Vector3 y = Vector3::UnitY();
  add_joint(arm, pose({0, 0, 0}), Vector3::UnitZ(), -180 * kDegree, 180 * kDegree, 150 * kDegree);
  add_joint(arm, pose({0.1, 0, 0.615}), y, -100 * kDegree, 110 * kDegree, 150 * kDegree);
  add_joint(arm, pose({0, 0, 0.705}), y, -60 * kDegree, 65 * kDegree, 150 * kDegree);
  add_joint(arm, pose({0, 0, 0.135}), x, -200 * kDegree, 200 * kDegree, 360 * kDegree);
  add_joint(arm, pose({0.755, 0, 0}), y, -120 * kDegree, 120 * kDegree, 360 * kDegree);
  add_joint(arm, pose({0.085, 0, 0}), x, -400 * kDegree, 400 * kDegree, 450 * kDegree);
  arm.X_LT = pose({0.2, 0, 0}, 0.0, kPi / 2);
  return arm;
}

ArmDescription xarm7() {
  ArmDescription arm;
  arm.name = "xarm7";
  const Vector3 z = Vector3::UnitZ();
  const double full = 2.0 * kPi;
  add_joint(arm, pose({0, 0, 0.267}), z, -full, full, 3.14);
  add_joint(arm, pose({0, 0, 0}, -kPi / 2), z, -2.059, 2.0944, 3.14);
  add_joint(arm, pose({0, -0.293, 0}, kPi / 2), z, -full, full, 3.14);
  add_joint(arm, pose({0.0525, 0, 0}, kPi / 2), z, -0.19198, 3.927, 3.14);
  add_joint(arm, pose({0.0775, -0.3425, 0}, kPi / 2), z, -full, full, 3.14);
  add_joint(arm, pose({0, 0, 0}, kPi / 2), z, -1.69297, kPi, 3.14);
  add_joint(arm, pose({0.076, 0.097, 0}, -kPi / 2), z, -full, full, 3.14);
  return arm;
}

}  // namespace breakshot::support
