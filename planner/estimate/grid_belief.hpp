#pragma once

#include "planner/strategy/strategy.hpp"

#include <cstddef>
#include <functional>
#include <vector>

namespace breakshot::estimate {

/// What is believed of one positive number: a probability for each point of a grid. Takes observations of any shape, also ones that may be
/// outliers, which is why it is no Gaussian.
class GridBelief {
 public:
  /// @param low, high  ends of the grid, low < high
  /// @param points     evenly spaced, at least 2
  GridBelief(double low, double high, std::size_t points);

  /// Starts anew from a prior: its logarithm at a point, up to a constant.
  void set_prior(const std::function<double(double)>& log_density);
  /// Multiplies by a likelihood: its logarithm at a point, up to a constant.
  void observe(const std::function<double(double)>& log_likelihood);

  strategy::Belief belief() const noexcept;

 private:
  double at(std::size_t point) const noexcept {
    return low_ + (high_ - low_) * static_cast<double>(point) / static_cast<double>(log_.size() - 1);
  }

  double low_, high_;
  std::vector<double> log_;
};

/// Logarithm of a normal density that lets a share of observations be anything within [low, high]: a measurement that went wrong says nothing,
/// and not that the world is strange.
double log_normal_or_outlier(double observed, double expected, double sigma, double outliers, double low, double high) noexcept;

}  // namespace breakshot::estimate
