#include "tests/support/arms.hpp"

#include <numbers>
#include <string>

namespace breakshot::support {
namespace {

constexpr double kPi = std::numbers::pi;

Pose pose(const Vector3& p, double roll = 0.0) {
  Pose X{Eigen::Translation3d{p}};
  X.rotate(Eigen::AngleAxisd{roll, Vector3::UnitX()});
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

ArmDescription load(const std::string& name) { return load_arm(BREAKSHOT_TEST_ARMS "/" + name + ".urdf", "base_link", "tip"); }

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

ArmDescription panda() { return load("panda"); }
ArmDescription irb2400() { return load("irb2400"); }
ArmDescription xarm7() { return load("xarm7"); }

}  // namespace breakshot::support
