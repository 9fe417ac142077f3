#pragma once

#include "common/geometry.hpp"
#include "common/joints.hpp"
#include "common/urdf/arm_description.hpp"

#include <array>

namespace breakshot::sim_bridge {

/// Where every link is, in W, for one set of joint angles.
struct ArmPosture {
  int joints = 0;
  std::array<Pose, kMaxJoints> X_WL;  ///< link frames; joint i turns about axis_W[i] through the origin of X_WL[i]
  std::array<Vector3, kMaxJoints> axis_W;
  Pose X_WT{Pose::Identity()};  ///< striker tip
};

using MassMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxJoints, kMaxJoints>;
using TipJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxJoints>;

/// Rigid-body kinematics and dynamics of a serial arm: what the drives compute to feed torque forward, and what an impact at the tip meets.
///
/// The drives' model. The arm itself is made of ODE bodies (arm_body.hpp); a test holds the two against each other.
/// Const and allocation-free after construction: any thread may use one.
class ArmDynamics {
 public:
  /// @param X_WB           pose of the arm's base; gravity points along -z of W
  /// @param rotor_inertia  of each drive, reflected through its gear, kg m^2
  ArmDynamics(const ArmDescription& arm, const Pose& X_WB, double rotor_inertia);

  int joints() const noexcept { return joints_; }

  /// @param q  rad, joints() entries
  ArmPosture posture(const JointVector& q) const noexcept;

  /// Joint torques that give the arm acceleration qdd at this posture and speed, against its own gravity, N m. Recursive Newton-Euler
  /// (Luh, Walker and Paul 1980), in W. Cost: under a microsecond for six joints.
  JointVector torque(const ArmPosture& posture, const JointVector& qd, const JointVector& qdd) const noexcept;

  /// Joint-space inertia, kg m^2.
  MassMatrix mass_matrix(const ArmPosture& posture) const noexcept;

  /// Velocity of the tip's origin in W per joint speed, m.
  TipJacobian tip_jacobian(const ArmPosture& posture) const noexcept;

  /// J M^-1 J^T of the tip's origin in the table plane: the change of the tip's velocity per horizontal impulse that it takes, 1/kg.
  /// The effective mass along a unit vector n is 1 / (n^T A n).
  Matrix2 tip_mobility(const ArmPosture& posture) const noexcept;

 private:
  struct Link {
    Pose X_PL;
    Vector3 axis_L;
    double mass;
    Vector3 p_LCom;
    Matrix3 I_Com_L;
  };

  JointVector newton_euler(const ArmPosture& posture, const JointVector& qd, const JointVector& qdd, double gravity) const noexcept;

  int joints_;
  std::array<Link, kMaxJoints> links_;
  Pose X_WB_;
  Pose X_LT_;
  double rotor_inertia_;
};

}  // namespace breakshot::sim_bridge
