#include "controller/motion/tip_tracker.hpp"

#include <Eigen/Cholesky>

namespace breakshot::motion {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;
using TaskJacobian = Eigen::Matrix<double, 5, Eigen::Dynamic, Eigen::ColMajor, 5, kMaxJoints>;

constexpr double kTolerance = 1e-10;
constexpr int kMaxIterations = 8;
/// Neighbouring points are a few millimetres apart at most; a larger joint step means a jump to another branch or a singular place, rad.
constexpr double kLongestStep = 0.3;

/// Rows: linear velocity, then turning of the rod's axis about the tip's x and y. A turn about z, the rod itself, is no condition.
TaskJacobian task_jacobian(const kinematics::Jacobian& J_W, const Matrix3& R_WT) noexcept {
  TaskJacobian J(5, J_W.cols());
  J.topRows<3>() = J_W.topRows<3>();
  J.bottomRows<2>().noalias() = R_WT.leftCols<2>().transpose() * J_W.bottomRows<3>();
  return J;
}

/// The least joint step that does the task.
JointVector least_step(const TaskJacobian& J, const Vector5& task) noexcept {
  const Matrix5 A = J * J.transpose();
  return J.transpose() * A.llt().solve(task);
}

}  // namespace

bool TipTracker::follow(const Vector3& p_WT, const Vector3& axis_W, JointVector& q) const noexcept {
  kinematics::Jacobian J_W;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Pose X_WT = arm_->tip_in_world(q, J_W);
    const Matrix3 R_WT = X_WT.linear();
    const Vector3 turn_W = R_WT.col(2).cross(axis_W);
    Vector5 error;
    error.head<3>() = p_WT - X_WT.translation();
    error.tail<2>() = R_WT.leftCols<2>().transpose() * turn_W;
    if (error.cwiseAbs().maxCoeff() < kTolerance && R_WT.col(2).dot(axis_W) > 0.0) return true;
    const JointVector step = least_step(task_jacobian(J_W, R_WT), error);
    if (!(step.cwiseAbs().maxCoeff() < kLongestStep)) return false;  // also for NaN, from a singular place
    q += step;
  }
  return false;
}

JointVector TipTracker::joint_speed(const JointVector& q, const Vector3& v_WT_W) const noexcept {
  kinematics::Jacobian J_W;
  const Pose X_WT = arm_->tip_in_world(q, J_W);
  Vector5 task = Vector5::Zero();
  task.head<3>() = v_WT_W;
  return least_step(task_jacobian(J_W, X_WT.linear()), task);
}

}  // namespace breakshot::motion
