#pragma once

#include "common/scene.hpp"
#include "common/stroke.hpp"
#include "planner/world/formation.hpp"
#include "planner/world/virtual_world.hpp"
#include "tests/planner/clusters.hpp"

#include <random>
#include <vector>

namespace breakshot::test {

/// How the "real" table of a test differs from what the planner believes.
struct TableTruth {
  double position_noise = 3e-4;  ///< of what perception reports, standard deviation, m
  double friction = 0.25;
  double restitution = 0.8;
  double speed_error = 0.02;       ///< of hits, uniform, relative
  double aim_error = 0.0087;       ///< of directions, uniform, rad: 0.5 degrees
  const char* law = "sequential";  ///< with real gaps between the discs, collisions are one after the other
  double striker_mass = 1.2;       ///< as striker_mass_test.cpp finds it, kg
  double drive_bandwidth = 160;    ///< rad/s; it and the next as `bench prediction` finds them, a little off what the planner believes
  double striker_bounce_speed = 0.19;
  double hit_braking = 0.5;
  double hit_lift = 0.12;
};

/// A table that obeys the virtual world under true parameters that the planner does not know: pushes run with full dynamics there, while the
/// planner predicts them without. No substitute for the ODE cell; it shows in milliseconds whether a strategy converges.
class TableSim {
 public:
  TableSim(std::vector<Disc> discs, const TableTruth& truth, std::uint64_t seed)
      : discs_{std::move(discs)}, truth_{truth}, random_{seed}, world_{settings_of(truth), world::make_impact_law(truth.law)} {}

  /// What perception would report of the table at rest.
  Scene scene() {
    Scene scene;
    scene.seq = ++scenes_;
    std::normal_distribution noise{0.0, truth_.position_noise};
    for (std::size_t i = 0; i < discs_.size(); ++i) {
      SceneDisc seen;
      seen.id = static_cast<std::uint32_t>(i + 1);
      seen.p_WD = discs_[i].p_WD + Vector2{noise(random_), noise(random_)};
      seen.radius = discs_[i].radius;
      seen.covariance = truth_.position_noise * truth_.position_noise * Matrix2::Identity();
      scene.discs.push_back(seen);
    }
    return scene;
  }

  /// Runs a stroke to rest. @return false when the world could not carry it through
  bool run(const StrokeRequest& stroke) {
    const auto uniform = [&](double half) { return std::uniform_real_distribution{-half, half}(random_); };
    world::StrikerRun run;
    const double turn = uniform(truth_.aim_error);
    run.direction = Eigen::Rotation2Dd{turn} * stroke.direction_W;
    const bool hit = stroke.kind == StrokeKind::kHit;
    run.speed = stroke.speed * (1.0 + (hit ? uniform(truth_.speed_error) : 0.0));
    run.p_WS = stroke.p_WS - (hit ? stroke.run_in : 0.0) * run.direction;
    run.cruise = hit ? stroke.run_in : stroke.length;
    run.braking = truth_.hit_braking;
    run.lift = truth_.hit_lift;
    run.mobility = Matrix2::Identity() / truth_.striker_mass;
    run.bandwidth = truth_.drive_bandwidth;
    const auto rollout = world_.run(discs_, &run);
    if (!rollout || rollout->status != world::Rollout::Status::kAtRest) return false;
    for (std::size_t i = 0; i < discs_.size(); ++i) discs_[i].p_WD = rollout->p_WD[i];
    world::part_overlaps(discs_);
    return true;
  }

  int outside(const Rect& region) const {
    int count = 0;
    for (const Disc& disc : discs_) count += region.contains(disc.p_WD) ? 0 : 1;
    return count;
  }
  const std::vector<Disc>& discs() const { return discs_; }
  void shift(std::size_t disc, const Vector2& by) { discs_[disc].p_WD += by; }

 private:
  static world::WorldSettings settings_of(const TableTruth& truth) {
    world::WorldSettings settings;
    settings.friction = truth.friction;
    settings.restitution = truth.restitution;
    settings.striker_bounce_speed = truth.striker_bounce_speed;
    settings.allowed_overlap = 1e-3;
    return settings;
  }

  std::vector<Disc> discs_;
  TableTruth truth_;
  std::mt19937_64 random_;
  world::VirtualWorld world_;
  std::uint64_t scenes_ = 0;
};

}  // namespace breakshot::test
