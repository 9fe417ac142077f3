#include "controller/motion/tip_tracker.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <cmath>

namespace breakshot::motion {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;
using TaskJacobian = Eigen::Matrix<double, 5, Eigen::Dynamic, Eigen::ColMajor, 5, kMaxJoints>;

/// Newton's method squares the error: a step from below this ends below 1e-10, so it needs no further look.
constexpr double kLastStep = 1e-6;
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

}  // namespace

bool TipTracker::follow(const Vector3& p_WT, const Vector3& v_WT_W, const Vector3& axis_W, JointVector& q, JointVector& qd) const noexcept {
  kinematics::Jacobian J_W;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Pose X_WT = arm_->tip_in_world(q, J_W);
    const Matrix3 R_WT = X_WT.linear();
    if (R_WT.col(2).dot(axis_W) < 0.0) return false;
    Vector5 error;
    error.head<3>() = p_WT - X_WT.translation();
    error.tail<2>() = R_WT.leftCols<2>().transpose() * R_WT.col(2).cross(axis_W);
    // The least joint step that does the task: J^T (J J^T)^-1.
    const TaskJacobian J = task_jacobian(J_W, R_WT);
    const Matrix5 A = J * J.transpose();
    const Eigen::LLT<Matrix5> factored{A};
    JointVector step = JointVector::Zero(q.size());
    step.noalias() = J.transpose() * factored.solve(error);
    if (!(step.cwiseAbs().maxCoeff() < kLongestStep)) return false;  // also for NaN, from a singular place
    q += step;
    if (error.cwiseAbs().maxCoeff() > kLastStep) continue;
    Vector5 task = Vector5::Zero();
    task.head<3>() = v_WT_W;
    qd = J.transpose() * factored.solve(task);
    return true;
  }
  return false;
}

JointVector TipTracker::joint_speed(const JointVector& q, const Vector3& v_WT_W) const noexcept {
  kinematics::Jacobian J_W;
  const Pose X_WT = arm_->tip_in_world(q, J_W);
  const TaskJacobian J = task_jacobian(J_W, X_WT.linear());
  const Matrix5 A = J * J.transpose();
  Vector5 task = Vector5::Zero();
  task.head<3>() = v_WT_W;
  return J.transpose() * A.llt().solve(task);
}

double TipTracker::singularity_margin(const JointVector& q) const noexcept {
  kinematics::Jacobian J_W;
  const Pose X_WT = arm_->tip_in_world(q, J_W);
  const TaskJacobian J = task_jacobian(J_W, X_WT.linear());
  const Matrix5 A = J * J.transpose();
  // Squares of the joint speeds that unit tip speed takes: the upper left of (J J^T)^-1.
  const Matrix5 inverse = A.llt().solve(Matrix5::Identity());
  const Matrix3 taken = inverse.topLeftCorner<3, 3>();
  Eigen::SelfAdjointEigenSolver<Matrix3> solver;
  solver.computeDirect(taken, Eigen::EigenvaluesOnly);
  const double most = solver.eigenvalues()[2];
  return most > 0.0 && std::isfinite(most) ? 1.0 / std::sqrt(most) : 0.0;
}

}  // namespace breakshot::motion
