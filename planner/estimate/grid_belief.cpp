#include "planner/estimate/grid_belief.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::estimate {

GridBelief::GridBelief(double low, double high, std::size_t points) : low_{low}, high_{high}, log_(points, 0.0) {}

void GridBelief::set_prior(const std::function<double(double)>& log_density) {
  for (std::size_t i = 0; i < log_.size(); ++i) log_[i] = log_density(at(i));
}

void GridBelief::observe(const std::function<double(double)>& log_likelihood) {
  for (std::size_t i = 0; i < log_.size(); ++i) log_[i] += log_likelihood(at(i));
  // Kept near zero, so that a thousand observations do not run out of numbers.
  const double most = *std::max_element(log_.begin(), log_.end());
  for (double& one : log_) one -= most;
}

strategy::Belief GridBelief::belief() const noexcept {
  const double most = *std::max_element(log_.begin(), log_.end());
  double sum = 0.0;
  double first = 0.0;
  double second = 0.0;
  for (std::size_t i = 0; i < log_.size(); ++i) {
    const double weight = std::exp(log_[i] - most);
    sum += weight;
    first += weight * at(i);
    second += weight * at(i) * at(i);
  }
  const double mean = first / sum;
  // The grid's own width is the least that it can be sure of.
  const double step = (high_ - low_) / static_cast<double>(log_.size() - 1);
  return {mean, std::sqrt(std::max(second / sum - mean * mean, step * step / 12.0))};
}

double log_normal_or_outlier(double observed, double expected, double sigma, double outliers, double low, double high) noexcept {
  const double z = (observed - expected) / sigma;
  const double normal = std::exp(-0.5 * z * z) / (sigma * std::sqrt(2.0 * std::numbers::pi));
  return std::log((1.0 - outliers) * normal + outliers / (high - low));
}

}  // namespace breakshot::estimate
