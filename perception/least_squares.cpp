#include "perception/least_squares.hpp"

#include <Eigen/Cholesky>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>

#include <algorithm>
#include <cmath>

namespace breakshot::perception {
namespace {

/// The model with its weights, as Eigen wants it.
struct Weighted {
  using Scalar = double;
  using InputType = Eigen::VectorXd;
  using ValueType = Eigen::VectorXd;
  using JacobianType = Eigen::MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  const Residuals* model;
  Eigen::VectorXd root_weights;
  Eigen::Index unknowns;

  int inputs() const { return static_cast<int>(unknowns); }
  int values() const { return static_cast<int>(root_weights.size()); }
  int operator()(const Eigen::VectorXd& x, Eigen::VectorXd& r) const {
    (*model)(x, r);
    r.array() *= root_weights.array();
    return 0;
  }
};

// A hundred times the step at which rounding of a pixel's coordinates would show in a difference.
constexpr double kDifferenceStep = 1e-12;  // relative step squared
constexpr int kMaxRounds = 20;

Eigen::VectorXd huber_weights(const Eigen::VectorXd& r, double huber) {
  Eigen::VectorXd weights(r.size());
  for (Eigen::Index i = 0; i < r.size(); i += 2) {
    const Eigen::Index pair = std::min<Eigen::Index>(2, r.size() - i);
    const double length = r.segment(i, pair).norm();
    weights.segment(i, pair).setConstant(length > huber ? huber / length : 1.0);
  }
  return weights;
}

}  // namespace

LeastSquaresFit least_squares(const Residuals& residuals, const Eigen::VectorXd& start, Eigen::Index count, double huber) {
  LeastSquaresFit fit{start, Eigen::VectorXd(count), Eigen::VectorXd::Ones(count), {}};
  Weighted model{&residuals, Eigen::VectorXd::Ones(count), start.size()};
  for (int round = 0; round < kMaxRounds; ++round) {
    Eigen::NumericalDiff<Weighted, Eigen::Central> differentiated{model, kDifferenceStep};
    Eigen::LevenbergMarquardt<decltype(differentiated)> solver{differentiated};
    solver.minimize(fit.x);
    residuals(fit.x, fit.residuals);
    const Eigen::VectorXd before = fit.weights;
    fit.weights = huber_weights(fit.residuals, huber);
    if ((fit.weights - before).cwiseAbs().maxCoeff() < 1e-6) break;
    model.root_weights = fit.weights.cwiseSqrt();
  }
  Eigen::MatrixXd jacobian(count, start.size());
  Eigen::NumericalDiff<Weighted, Eigen::Central>{model, kDifferenceStep}.df(fit.x, jacobian);
  const Eigen::LDLT<Eigen::MatrixXd> normal{jacobian.transpose() * jacobian};
  fit.inverse = normal.solve(Eigen::MatrixXd::Identity(start.size(), start.size()));
  if (!normal.isPositive() || !fit.inverse.allFinite() || !(fit.inverse.diagonal().array() > 0.0).all()) {
    fit.inverse.setConstant(std::numeric_limits<double>::infinity());
  }
  return fit;
}

Pose nearby(const Pose& X_AB, const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& step) {
  const double angle = step.head<3>().norm();
  Pose X{X_AB};
  if (angle > 0.0) X.linear() = Eigen::AngleAxisd{angle, step.head<3>() / angle}.toRotationMatrix() * X_AB.linear();
  X.translation() += step.tail<3>();
  return X;
}

}  // namespace breakshot::perception
