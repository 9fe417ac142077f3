#include "planner/task/rest_forecast.hpp"

#include "planner/strategy/table_model.hpp"
#include "planner/task/scene_change.hpp"
#include "planner/world/formation.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace breakshot::task {

namespace {

/// Frames that lie further apart do not make a velocity: a collision in between would go unseen.
constexpr Duration kLongestGap = std::chrono::milliseconds{110};
/// Runs under other draws: a standard deviation is then good to a seventh.
constexpr int kDraws = 24;
constexpr double kLeastFriction = 0.01;

Vector2 drawn(const Vector2& mean, const Matrix2& covariance, SplitMix64& random) {
  const Vector2 noise{random.normal(), random.normal()};
  // Of a positive semidefinite matrix too, which a covariance of exact places is.
  const Eigen::SelfAdjointEigenSolver<Matrix2> axes{covariance};
  return mean + axes.eigenvectors() * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt().cwiseProduct(noise);
}

}  // namespace

RestForecast::RestForecast(const strategy::StrategySettings& knowledge, double settle_speed)
    : cell_{knowledge.cell}, settle_speed_{settle_speed} {}

void RestForecast::on_scene(const Scene& scene) {
  newest_ = scene;
  for (const SceneDisc& disc : scene.discs) {
    // The visible part of a disc that something covers may shift the place found for it.
    if (!disc.complete) continue;
    auto track = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return t.disc.id == disc.id; });
    if (track == tracks_.end()) {
      // No disc moved since the frame before, which is not among those that count: so none moves now.
      const bool rests = scene.max_speed < settle_speed_;
      tracks_.push_back(
          {disc, {scene.exposed, disc.p_WD, disc.covariance}, {scene.exposed - kLongestGap, disc.p_WD, disc.covariance}, rests});
      continue;
    }
    if (scene.exposed <= track->now.seen) continue;
    track->disc = disc;
    track->before = track->now;
    track->now = {scene.exposed, disc.p_WD, disc.covariance};
    track->known = track->now.seen - track->before.seen <= kLongestGap;
  }
}

bool RestForecast::slides(const Track& track) const noexcept {
  const Vector2 moved = track.now.p_WD - track.before.p_WD;
  return moved.norm() >= settle_speed_ * to_seconds(track.now.seen - track.before.seen) &&
         in_sigmas(moved, track.now.covariance + track.before.covariance) > kSamePlace;
}

std::vector<const RestForecast::Track*> RestForecast::complete(std::size_t discs) const {
  std::vector<const Track*> tracks;
  if (tracks_.size() != discs) return tracks;
  for (const SceneDisc& disc : newest_.discs) {
    const auto track = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return t.disc.id == disc.id; });
    if (track != tracks_.end() && track->now.seen == newest_.exposed) tracks.push_back(&*track);
  }
  // One that is seen in part only would stand in the middle of the newest scene's order, with a place that is worth less than an older one.
  if (tracks.size() != newest_.discs.size()) return {};
  for (const Track& track : tracks_) {
    if (track.now.seen != newest_.exposed) tracks.push_back(&track);
    const bool gone = track.now.seen != newest_.exposed && track.known && slides(track);
    if (!track.known || gone) return {};
  }
  return tracks;
}

std::optional<std::vector<Vector2>> RestForecast::run(const std::vector<const Track*>& tracks, const strategy::TableBelief& belief,
                                                      SplitMix64* random) const {
  world::WorldSettings physics = cell_.world;
  physics.touch_gap = world::WorldSettings{}.touch_gap;
  physics.allowed_overlap = strategy::kNoiseOverlap;
  const auto draw = [&](const strategy::Belief& one) { return one.mean + (random != nullptr ? one.sigma * random->normal() : 0.0); };
  physics.friction = std::max(kLeastFriction, draw(belief.friction));
  physics.restitution = std::clamp(draw(belief.restitution), 0.0, 1.0);

  std::vector<world::Disc> discs;
  for (const Track* track : tracks) {
    world::Disc disc;
    disc.radius = track->disc.radius;
    disc.mass = cell_.disc_mass * disc.radius * disc.radius / (cell_.disc_radius * cell_.disc_radius);
    disc.p_WD = random != nullptr ? drawn(track->now.p_WD, track->now.covariance, *random) : track->now.p_WD;
    if (slides(*track)) {
      const Vector2 from = random != nullptr ? drawn(track->before.p_WD, track->before.covariance, *random) : track->before.p_WD;
      const double time = to_seconds(track->now.seen - track->before.seen);
      const Vector2 mean_W = (disc.p_WD - from) / time;
      // The mean over the frame is the velocity in its middle; since then friction has taken half a frame's worth.
      const double speed = mean_W.norm() - 0.5 * physics.friction * kGravity * time;
      if (speed > 0.0) disc.v_WD_W = speed * mean_W.normalized();
    }
    discs.push_back(disc);
  }
  world::part_overlaps(discs);
  world::VirtualWorld world{physics, world::make_impact_law("sequential")};
  const auto rollout = world.run(discs);
  if (!rollout || rollout->status != world::Rollout::Status::kAtRest) return std::nullopt;
  return std::vector<Vector2>(rollout->p_WD.begin(), rollout->p_WD.end());
}

bool RestForecast::spread(Forecast& forecast, const std::vector<const Track*>& tracks, const strategy::TableBelief& belief) const {
  SplitMix64 random{newest_.seq + 1};
  for (SceneDisc& disc : forecast.scene.discs) disc.covariance.setZero();
  for (int k = 0; k < kDraws; ++k) {
    const auto p_WD = run(tracks, belief, &random);
    if (!p_WD) return false;
    for (std::size_t i = 0; i < tracks.size(); ++i) {
      SceneDisc& disc = forecast.scene.discs[i];
      const Vector2 error = (*p_WD)[i] - disc.p_WD;
      disc.covariance += error * error.transpose() / kDraws;
    }
  }
  return true;
}

std::optional<RestForecast::Forecast> RestForecast::forecast(std::size_t discs, const strategy::TableBelief& belief) {
  const auto tracks = complete(discs);
  if (tracks.empty()) return std::nullopt;
  Forecast forecast;
  forecast.scene = newest_;
  forecast.scene.discs.clear();
  for (const Track* track : tracks) {
    forecast.scene.discs.push_back(track->disc);
    forecast.slid = forecast.slid || slides(*track);
  }
  if (forecast.slid) {
    const auto p_WD = run(tracks, belief, nullptr);
    if (!p_WD) return std::nullopt;
    for (std::size_t i = 0; i < tracks.size(); ++i) forecast.scene.discs[i].p_WD = (*p_WD)[i];
    if (!spread(forecast, tracks, belief)) return std::nullopt;
    // Contacts were found where the discs are, which is not where they will rest; strategies find those of the forecast by themselves.
    forecast.scene.contacts.clear();
  }
  for (SceneDisc& disc : forecast.scene.discs) {
    disc.v_WD_W.setZero();
    const double variance = Eigen::SelfAdjointEigenSolver<Matrix2>{disc.covariance}.eigenvalues().maxCoeff();
    forecast.sigma = std::max(forecast.sigma, std::sqrt(std::max(0.0, variance)));
  }
  forecast.scene.max_speed = 0.0;
  return forecast;
}

}  // namespace breakshot::task
