#pragma once

#include "common/geometry.hpp"

#include <Eigen/Core>

#include <functional>
#include <limits>

namespace breakshot::perception {

/// Residuals of a model with few unknowns, for a vector of them: fills r, whose size says how many there are.
using Residuals = std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& r)>;

struct LeastSquaresFit {
  Eigen::VectorXd x;
  Eigen::VectorXd residuals;  ///< at x, as the model gives them
  Eigen::VectorXd weights;    ///< of each residual, 0 to 1
  Eigen::MatrixXd inverse;    ///< (J^T W J)^-1: the covariance of x for residuals of variance 1; infinite where x is not determined
};

/// Minimises the sum of squares (Levenberg and Marquardt, as MINPACK has it), numerically differentiated.
///
/// @param count  of residuals, at least as many as unknowns; they come in pairs (x and y of one point)
/// @param huber  pairs that are longer than this count in proportion to their length only, not to its square (Huber 1964); infinity: all alike
LeastSquaresFit least_squares(const Residuals& residuals, const Eigen::VectorXd& start, Eigen::Index count,
                              double huber = std::numeric_limits<double>::infinity());

/// A pose near another: six small unknowns, rotation vector (rad) and translation (m) in the frame of the left side of X_AB.
Pose nearby(const Pose& X_AB, const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& step);

}  // namespace breakshot::perception
