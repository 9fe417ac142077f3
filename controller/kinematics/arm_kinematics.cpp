#include "controller/kinematics/arm_kinematics.hpp"

#include <kdl/frames.hpp>

#include <cmath>
#include <stdexcept>

namespace breakshot::kinematics {
namespace {

KDL::Frame to_kdl(const Pose& X) {
  const Matrix3 R = X.linear();
  const Vector3 p = X.translation();
  return {KDL::Rotation{R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)}, KDL::Vector{p.x(), p.y(), p.z()}};
}

Vector3 from_kdl(const KDL::Vector& v) noexcept { return {v.x(), v.y(), v.z()}; }

Pose from_kdl(const KDL::Frame& X) noexcept {
  Pose pose;
  pose.linear() << X.M(0, 0), X.M(0, 1), X.M(0, 2), X.M(1, 0), X.M(1, 1), X.M(1, 2), X.M(2, 0), X.M(2, 1), X.M(2, 2);
  pose.translation() = from_kdl(X.p);
  pose.makeAffine();
  return pose;
}

/// A rotation that takes z to the axis. Exactly the identity for z itself, so that usual URDFs gain no rounding.
Matrix3 z_to(const Vector3& axis) {
  if (axis == Vector3::UnitZ()) return Matrix3::Identity();
  return Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), axis).toRotationMatrix();
}

void require(bool condition, const std::string& text) {
  if (!condition) throw std::invalid_argument{text};
}

}  // namespace

ArmKinematics::ArmKinematics(const ArmDescription& arm, const Pose& X_WB) : X_WB_{X_WB} {
  const std::size_t n = arm.joints.size();
  require(n >= 1 && n <= static_cast<std::size_t>(kMaxJoints),
          "arm '" + arm.name + "' has " + std::to_string(n) + " joints; allowed 1 to " + std::to_string(kMaxJoints));
  lower_.resize(static_cast<Eigen::Index>(n));
  upper_.resize(static_cast<Eigen::Index>(n));
  max_speed_.resize(static_cast<Eigen::Index>(n));
  // Joint i turns about z of frame J_i = L_i * A_i. Segment i is RotZ(q_i) followed by the fixed step J_i -> J_{i+1} (or the tip).
  Pose step = Pose::Identity();
  Matrix3 A_previous = Matrix3::Identity();
  for (std::size_t i = 0; i <= n; ++i) {
    const Matrix3 A = i < n ? z_to(arm.joints[i].axis_L) : Matrix3::Identity();
    const Pose& X_PL = i < n ? arm.joints[i].X_PL : arm.X_LT;
    step = Pose{A_previous.transpose()} * X_PL * Pose{A};
    const KDL::Joint joint = i == 0 ? KDL::Joint{KDL::Joint::None} : KDL::Joint{arm.joints[i - 1].name, KDL::Joint::RotZ};
    chain_.addSegment(KDL::Segment{i == 0 ? "base" : arm.joints[i - 1].name, joint, to_kdl(step)});
    if (i == n) break;
    A_previous = A;
    R_JL_.push_back(to_kdl(Pose{Matrix3{A.transpose()}}).M);
    const JointDescription& j = arm.joints[i];
    require(std::isfinite(j.lower) && std::isfinite(j.upper) && j.lower < j.upper && std::isfinite(j.max_speed) && j.max_speed > 0.0,
            "joint '" + j.name + "': needs finite limits with lower < upper and a speed above zero");
    const auto k = static_cast<Eigen::Index>(i);
    lower_[k] = j.lower;
    upper_[k] = j.upper;
    max_speed_[k] = j.max_speed;
  }
}

bool ArmKinematics::within_limits(const JointVector& q, double tolerance) const noexcept {
  return (q.array() >= lower_.array() - tolerance).all() && (q.array() <= upper_.array() + tolerance).all();
}

Pose ArmKinematics::tip_in_base(const JointVector& q) const noexcept {
  KDL::Frame X = chain_.getSegment(0).pose(0.0);
  for (int i = 0; i < joints(); ++i) X = X * chain_.getSegment(static_cast<unsigned>(i + 1)).pose(q[i]);
  return from_kdl(X);
}

Pose ArmKinematics::tip_in_world(const JointVector& q, Jacobian& J_W) const noexcept {
  const int n = joints();
  J_W.resize(6, n);
  const Matrix3 R_WB = X_WB_.linear();
  KDL::Frame X = chain_.getSegment(0).pose(0.0);
  for (int i = 0; i < n; ++i) {  // first the axes and points on them ...
    J_W.col(i).head<3>() = R_WB * from_kdl(X.p);
    J_W.col(i).tail<3>() = R_WB * from_kdl(X.M.UnitZ());
    X = X * chain_.getSegment(static_cast<unsigned>(i + 1)).pose(q[i]);
  }
  const Vector3 p_BT_W = R_WB * from_kdl(X.p);
  for (int i = 0; i < n; ++i) {  // ... then, with the tip known, what a turn about each does to it
    const Vector3 axis_W = J_W.col(i).tail<3>();
    const Vector3 arm_W = p_BT_W - J_W.col(i).head<3>();
    J_W.col(i).head<3>() = axis_W.cross(arm_W);
  }
  return X_WB_ * from_kdl(X);
}

Pose ArmKinematics::links_in_world(const JointVector& q, std::span<Pose> X_WL) const noexcept {
  KDL::Frame X = chain_.getSegment(0).pose(0.0);
  for (int i = 0; i < joints(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    X_WL[k] = X_WB_ * from_kdl(X * KDL::Frame{KDL::Rotation::RotZ(q[i]) * R_JL_[k]});
    X = X * chain_.getSegment(static_cast<unsigned>(i + 1)).pose(q[i]);
  }
  return X_WB_ * from_kdl(X);
}

}  // namespace breakshot::kinematics
