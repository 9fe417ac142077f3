#include "controller/kinematics/general_ik.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace breakshot::kinematics {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// A rotation error of 1 rad weighs as much as this many metres: about the distance from the wrist to the tip of the arms in use.
constexpr double kRotationWeight = 0.3;
/// Longest step of a joint, rad: beyond it the linearisation says little.
constexpr double kLongestStep = 0.6;
/// Damping that stays when the residual vanishes, so that singular poses are solvable.
constexpr double kLeastDamping = 1e-9;
/// A start is given up when this many iterations did not cut the residual to kProgress of what it was.
constexpr int kPatience = 5;
constexpr double kProgress = 0.7;

/// Van der Corput's sequence in a base: the digits of n mirrored at the point.
double radical_inverse(int n, int base) noexcept {
  double result = 0.0;
  double digit = 1.0 / base;
  for (; n > 0; n /= base, digit /= base) result += digit * (n % base);
  return result;
}

/// Rotation vector of R, in the frame that R maps to; length in [0, pi].
Vector3 rotation_vector(const Matrix3& R) noexcept {
  const Eigen::AngleAxisd turn{R};
  return turn.angle() * turn.axis();
}

Vector6 pose_error(const Pose& X_WT, const Pose& X_WG) noexcept {
  Vector6 error;
  error.head<3>() = X_WG.translation() - X_WT.translation();
  error.tail<3>() = rotation_vector(X_WG.linear() * X_WT.linear().transpose());
  return error;
}

}  // namespace

JointVector GeneralIk::start(int number, const JointVector& near) const noexcept {
  if (number == 0) return near.cwiseMax(arm_->lower()).cwiseMin(arm_->upper());
  static constexpr std::array<int, kMaxJoints> kPrimes{2, 3, 5, 7, 11, 13, 17};
  JointVector q(arm_->joints());
  for (int i = 0; i < arm_->joints(); ++i) {
    // Of a joint that can turn more than once, one turn about the middle of its range holds all that it can do.
    const double middle = 0.5 * (arm_->lower()[i] + arm_->upper()[i]);
    const double half = std::min(0.5 * (arm_->upper()[i] - arm_->lower()[i]), std::numbers::pi);
    q[i] = middle + half * (2.0 * radical_inverse(number, kPrimes[static_cast<std::size_t>(i)]) - 1.0);
  }
  return q;
}

bool GeneralIk::descend(const Pose& X_WG, JointVector& q, double& residual) const noexcept {
  const int n = arm_->joints();
  Jacobian J;
  Vector6 error = pose_error(arm_->tip_in_world(q, J), X_WG);
  double reference = std::numeric_limits<double>::infinity();
  int since = 0;
  for (int iteration = 0;; ++iteration) {
    if (error.head<3>().norm() < options_.position && error.tail<3>().norm() < options_.rotation) return true;
    error.tail<3>() *= kRotationWeight;
    residual = error.squaredNorm();
    if (residual < kProgress * kProgress * reference) {
      reference = residual;
      since = 0;
    } else if (++since > kPatience) {
      return false;
    }
    if (iteration == options_.iterations) return false;

    J.bottomRows<3>() *= kRotationWeight;
    JointVector dq = JointVector::Zero(n);
    // At most one round per joint: each round holds at least one more joint at its limit.
    for (int round = 0; round < n; ++round) {
      Matrix6 A = J * J.transpose();
      A.diagonal().array() += 0.01 * residual + kLeastDamping;
      dq = J.transpose() * A.llt().solve(error);
      bool held = false;
      for (int i = 0; i < n; ++i) {
        const bool outward = (q[i] >= arm_->upper()[i] && dq[i] > 0.0) || (q[i] <= arm_->lower()[i] && dq[i] < 0.0);
        if (!outward) continue;
        J.col(i).setZero();
        held = true;
      }
      if (!held) break;
    }
    dq *= std::min(1.0, kLongestStep / std::max(dq.cwiseAbs().maxCoeff(), 1e-12));
    q = (q + dq).cwiseMax(arm_->lower()).cwiseMin(arm_->upper());
    error = pose_error(arm_->tip_in_world(q, J), X_WG);
  }
}

GeneralIkResult GeneralIk::solve(const Pose& X_WT, const JointVector& near, int first_start) const noexcept {
  GeneralIkResult best;
  best.q = near;
  double least = std::numeric_limits<double>::infinity();
  for (int s = 0; s < options_.seeds; ++s) {
    JointVector q = start(first_start + s, near);
    double residual = std::numeric_limits<double>::infinity();
    const bool solved = descend(X_WT, q, residual);
    best.starts = s + 1;
    if (solved || residual < least) {
      least = residual;
      best.q = q;
    }
    if (solved) {
      best.solved = true;
      break;
    }
  }
  return best;
}

}  // namespace breakshot::kinematics
