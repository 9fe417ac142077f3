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

Pose pose_of(const Matrix3& R, const Vector3& p) noexcept {
  Pose X;
  X.linear() = R;
  X.translation() = p;
  X.makeAffine();
  return X;
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

ArmKinematics::ArmKinematics(const ArmDescription& arm, const Pose& X_WB) : X_WB_{X_WB}, X_BW_{X_WB.inverse()} {
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
    if (i == 0) {
      const Pose X_WJ = X_WB * step;
      first_ = {X_WJ.linear(), X_WJ.translation()};
    } else {
      steps_.push_back({step.linear(), step.translation()});
    }
    if (i == n) break;
    A_previous = A;
    R_JL_.emplace_back(A.transpose());
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

void ArmKinematics::Frame::advance(double q, const Frame& step) noexcept {
  const double c = std::cos(q);
  const double s = std::sin(q);
  const Vector3 x = c * R.col(0) + s * R.col(1);  // R * RotZ(q)
  R.col(1) = c * R.col(1) - s * R.col(0);
  R.col(0) = x;
  p.noalias() += R * step.p;
  R = R * step.R;
}

Pose ArmKinematics::tip_in_world(const JointVector& q) const noexcept {
  Frame X = first_;
  for (int i = 0; i < joints(); ++i) X.advance(q[i], steps_[static_cast<std::size_t>(i)]);
  return pose_of(X.R, X.p);
}

Pose ArmKinematics::tip_in_world(const JointVector& q, Jacobian& J_W) const noexcept {
  const int n = joints();
  J_W.resize(6, n);
  Frame X = first_;
  for (int i = 0; i < n; ++i) {  // first the axes and points on them ...
    J_W.col(i).head<3>() = X.p;
    J_W.col(i).tail<3>() = X.R.col(2);
    X.advance(q[i], steps_[static_cast<std::size_t>(i)]);
  }
  for (int i = 0; i < n; ++i) {  // ... then, with the tip known, what a turn about each does to it
    const Vector3 axis_W = J_W.col(i).tail<3>();
    const Vector3 arm_W = X.p - J_W.col(i).head<3>();
    J_W.col(i).head<3>() = axis_W.cross(arm_W);
  }
  return pose_of(X.R, X.p);
}

Pose ArmKinematics::links_in_world(const JointVector& q, std::span<Pose> X_WL) const noexcept {
  Frame X = first_;
  for (int i = 0; i < joints(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    Frame link = X;
    link.advance(q[i], {R_JL_[k], Vector3::Zero()});
    X_WL[k] = pose_of(link.R, link.p);
    X.advance(q[i], steps_[k]);
  }
  return pose_of(X.R, X.p);
}

}  // namespace breakshot::kinematics
