#include "planner/estimate/friction_estimate.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::estimate {

namespace {

constexpr double kGravity = 9.81;  // m/s^2
// What mu can be at all.
constexpr double kLeast = 0.01;
constexpr double kMost = 1.5;
constexpr std::size_t kPoints = 1500;
/// Scenes further apart than this do not show a deceleration: at 30 Hz, one lost frame.
constexpr Duration kLongestGap = std::chrono::milliseconds{70};
/// What shows that a disc had not stopped before.
constexpr double kStillMoving = 0.02;  // m/s
/// Errors of one disc's positions from frame to frame that its covariance does not hold (motion within the exposure), m.
constexpr double kMotionSigma = 3e-5;
/// An impact bends the track by more than noise: standard deviations.
constexpr double kStraight = 4.0;
/// Share of looks that are wrong without showing it.
constexpr double kOutliers = 0.1;
/// How likely it is that the table is not the one that the prior speaks of, and how far off it may be then (logarithm, standard deviation): a prior without
/// such a tail would outvote what is seen for many looks.
constexpr double kOtherTable = 0.02;
constexpr double kOtherWidth = 0.4;
constexpr std::size_t kMostLooks = 200;
/// Over this distance friction is about the same, m.
constexpr double kCorrelation = 0.15;
/// A map has this many cells along a side; a third of kCorrelation is a side of each, m, so that neighbours hardly differ.
constexpr int kMapCells = 20;
constexpr double kMapCell = 0.05;
/// Factors of a map are multiples of this: well within what is known of them, and borders that would change nothing cost nothing.
constexpr double kMapStep = 0.02;

}  // namespace

FrictionEstimate::FrictionEstimate(const FrictionPrior& prior) : prior_{prior}, belief_{kLeast, kMost, kPoints} {
  constexpr double kZ95 = 1.96;
  const double width = std::max(std::log(prior.factor) / kZ95, 1e-3);
  const auto log_normal = [&](double mu, double sigma) {
    const double z = std::log(mu / prior.mean) / sigma;
    return std::exp(-0.5 * z * z) / (sigma * mu);
  };
  belief_.set_prior(
      [&](double mu) { return std::log((1.0 - kOtherTable) * log_normal(mu, width) + kOtherTable * log_normal(mu, kOtherWidth)); });
}

void FrictionEstimate::on_scene(const Scene& scene) {
  if (scene.quality != SceneQuality::kOk) {
    tracks_.clear();
    return;
  }
  std::erase_if(tracks_, [&](const Track& track) {
    return std::none_of(scene.discs.begin(), scene.discs.end(), [&](const SceneDisc& disc) { return disc.id == track.id; });
  });
  for (const SceneDisc& disc : scene.discs) {
    auto track = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return t.id == disc.id; });
    if (track == tracks_.end()) track = tracks_.insert(tracks_.end(), Track{disc.id, {}});
    auto& places = track->places;
    if (!disc.complete ||
        (!places.empty() && (scene.exposed <= places.back().exposed || scene.exposed - places.back().exposed > kLongestGap))) {
      places.clear();
    }
    if (!disc.complete) continue;
    places.push_back({scene.exposed, disc.p_WD, 0.5 * disc.covariance.trace() + kMotionSigma * kMotionSigma});
    if (places.size() == 4) watch(*track);
  }
}

void FrictionEstimate::watch(Track& track) {
  auto& places = track.places;
  const double t1 = to_seconds(places[1].exposed - places[0].exposed);
  const double t2 = to_seconds(places[2].exposed - places[1].exposed);
  const double t3 = to_seconds(places[3].exposed - places[2].exposed);
  const Vector2 v1 = (places[1].p_WD - places[0].p_WD) / t1;
  const Vector2 v2 = (places[2].p_WD - places[1].p_WD) / t2;
  const Vector2 v3 = (places[3].p_WD - places[2].p_WD) / t3;
  const double sigma_p = std::sqrt(places[1].variance);
  // The first three places count; the fourth shows that the disc still moved, the same way, when the third was taken.
  const auto bent = [&](const Vector2& a, const Vector2& b, double t) {
    return std::abs(perpendicular(a.normalized()).dot(b)) * t > kStraight * 2.0 * sigma_p || a.dot(b) <= 0.0;
  };
  const bool moves = v1.norm() > prior_.slowest && v2.norm() > prior_.slowest && v3.norm() > kStillMoving;
  if (!moves || bent(v1, v2, t2) || bent(v2, v3, t3) || v2.norm() > v1.norm() + 4.0 * sigma_p / t2) {
    places.erase(places.begin());
    return;
  }
  const double span = 0.5 * (t1 + t2);
  const double deceleration = (v1.norm() - v2.norm()) / span;
  const double variance =
      (places[0].variance / (t1 * t1) + places[1].variance * std::pow(1.0 / t1 + 1.0 / t2, 2) + places[2].variance / (t2 * t2)) /
      (span * span);
  take({places[1].p_WD, deceleration / kGravity, std::sqrt(variance) / kGravity});
  // The next look shares one place with this one, not two: neighbouring looks would share their errors.
  places.erase(places.begin(), places.begin() + 2);
}

void FrictionEstimate::take(const Look& look) {
  ++looks_;
  belief_.observe([&](double mu) {
    const double sigma = std::hypot(look.sigma, prior_.local_spread * mu);
    return log_normal_or_outlier(look.mu, mu, sigma, kOutliers, 0.0, kMost);
  });
  if (looks_kept_.size() < kMostLooks) {
    looks_kept_.push_back(look);
  } else {
    looks_kept_[next_kept_] = look;
    next_kept_ = (next_kept_ + 1) % kMostLooks;
  }
}

FrictionEstimate::Regression FrictionEstimate::regression() const {
  const strategy::Belief mean = belief();
  Regression fit;
  fit.local = prior_.local_spread * mean.mean;
  for (const Look& look : looks_kept_) {
    const double sigma = std::hypot(look.sigma, fit.local);
    if (std::abs(look.mu - mean.mean) < 3.0 * sigma) fit.looks.push_back(&look);
  }
  const auto n = static_cast<Eigen::Index>(fit.looks.size());
  if (n == 0) return fit;
  Eigen::MatrixXd K(n, n);
  Eigen::VectorXd left(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Look& a = *fit.looks[static_cast<std::size_t>(i)];
    K.row(i) = fit.alike(a.p_W).transpose();
    K(i, i) += a.sigma * a.sigma;
    left(i) = a.mu - mean.mean;
  }
  fit.factor.compute(K);
  fit.weights = fit.factor.solve(left);
  return fit;
}

Eigen::VectorXd FrictionEstimate::Regression::alike(const Vector2& p_W) const {
  Eigen::VectorXd k(static_cast<Eigen::Index>(looks.size()));
  for (Eigen::Index i = 0; i < k.size(); ++i) {
    const Vector2& p = looks[static_cast<std::size_t>(i)]->p_W;
    k(i) = local * local * std::exp(-0.5 * (p - p_W).squaredNorm() / (kCorrelation * kCorrelation));
  }
  return k;
}

strategy::Belief FrictionEstimate::belief_at(const Vector2& p_W) const {
  const strategy::Belief mean = belief();
  const Regression fit = regression();
  if (fit.looks.empty()) return {mean.mean, std::hypot(mean.sigma, fit.local)};
  const Eigen::VectorXd k = fit.alike(p_W);
  const double variance = std::max(0.0, fit.local * fit.local - k.dot(fit.factor.solve(k)));
  return {mean.mean + k.dot(fit.weights), std::hypot(mean.sigma, std::sqrt(variance))};
}

std::shared_ptr<const world::FrictionMap> FrictionEstimate::map_around(const Vector2& p_W) const {
  const Regression fit = regression();
  if (fit.looks.empty()) return nullptr;
  const auto mu_at = [&, mean = belief().mean](const Vector2& p) { return std::max(kLeast, mean + fit.alike(p).dot(fit.weights)); };
  const double here = mu_at(p_W);
  const Vector2 corner = p_W - 0.5 * kMapCells * kMapCell * Vector2{1.0, 1.0};
  std::vector<double> factors;
  for (int row = 0; row < kMapCells; ++row) {
    for (int column = 0; column < kMapCells; ++column) {
      const double factor = mu_at(corner + kMapCell * Vector2{column + 0.5, row + 0.5}) / here;
      factors.push_back(std::max(kMapStep, kMapStep * std::round(factor / kMapStep)));
    }
  }
  return std::make_shared<const world::FrictionMap>(corner, kMapCell, kMapCells, std::move(factors));
}

}  // namespace breakshot::estimate
