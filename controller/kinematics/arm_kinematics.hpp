#pragma once

#include "common/geometry.hpp"
#include "common/joints.hpp"
#include "common/urdf/arm_description.hpp"

#include <Eigen/Core>
#include <kdl/chain.hpp>

#include <span>
#include <vector>

namespace breakshot::kinematics {

/// Tip velocity by joint velocity, columns base to tip; rows 0-2 linear (m/rad), rows 3-5 angular (rad/rad).
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxJoints>;

/// Forward kinematics of a serial arm on a KDL chain.
///
/// Immutable after construction, so any number of threads may share one. All const functions are real-time safe: no allocation, no
/// lock, bounded, about 0.2 us for six joints, with or without the Jacobian. Vectors of joints must have joints() entries.
///
/// The chain uses only RotZ joints, with every axis turned into the frames between them: KDL::Joint::RotAxis caches its last pose in
/// mutable members, which two threads must not share. Poses are computed from the chain's frames here and not by KDL::Segment::pose(), which
/// takes about twice as long; tests hold both against each other.
class ArmKinematics {
 public:
  /// @param X_WB  pose of the arm's base in W
  /// @throws std::invalid_argument when the arm has no joint, more than kMaxJoints, or limits that are not finite and ordered
  ArmKinematics(const ArmDescription& arm, const Pose& X_WB);

  int joints() const noexcept { return static_cast<int>(lower_.size()); }
  const JointVector& lower() const noexcept { return lower_; }          ///< rad
  const JointVector& upper() const noexcept { return upper_; }          ///< rad
  const JointVector& max_speed() const noexcept { return max_speed_; }  ///< rad/s
  const Pose& X_WB() const noexcept { return X_WB_; }
  bool within_limits(const JointVector& q, double tolerance = 1e-9) const noexcept;

  /// Pose of the striker tip in the base frame.
  Pose tip_in_base(const JointVector& q) const noexcept { return X_BW_ * tip_in_world(q); }
  /// Pose of the striker tip in W.
  Pose tip_in_world(const JointVector& q) const noexcept;
  /// Pose of the striker tip in W, and the Jacobian of its velocity in W.
  Pose tip_in_world(const JointVector& q, Jacobian& J_W) const noexcept;
  /// Poses in W of the moving links' frames as the URDF has them; X_WL has joints() entries. Returns the pose of the tip.
  Pose links_in_world(const JointVector& q, std::span<Pose> X_WL) const noexcept;

  /// The model itself, for KDL's own solvers: base to tip, joints() RotZ joints.
  const KDL::Chain& chain() const noexcept { return chain_; }

 private:
  /// A pose on its way up the chain.
  struct Frame {
    Matrix3 R;
    Vector3 p;
    /// Goes on by a turn about z and the fixed step after it.
    void advance(double q, const Frame& step) noexcept;
  };

  KDL::Chain chain_;
  Pose X_WB_, X_BW_;
  JointVector lower_, upper_, max_speed_;
  Frame first_;               ///< W to the first joint
  std::vector<Frame> steps_;  ///< each joint (after its turn) to the next, the last one to the tip
  /// Turns the chain's joint frame, with the axis along z, back into the URDF's link frame.
  std::vector<Matrix3> R_JL_;
};

}  // namespace breakshot::kinematics
