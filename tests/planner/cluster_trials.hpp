#pragma once

#include "planner/world/formation.hpp"
#include "planner/world/virtual_world.hpp"
#include "tests/planner/clusters.hpp"

#include <algorithm>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace breakshot::test {

/// What came of many rollouts that were made to be hard.
struct ClusterTrials {
  long rollouts = 0;
  long at_rest = 0;
  long overlaps = 0, overlaps_refused = 0;  ///< formations in which two discs really overlap
  long wrongly_refused = 0;
  int most_impacts = 0;
  double energy_gain = 0.0;     ///< largest relative rise in an impact
  double momentum_error = 0.0;  ///< largest relative change in an impact
  double smallest_gap = 0.0;    ///< m, at rest: how deep discs have sunk into each other
};

/// One formation after another under the law: touching exactly, nearly or not, symmetric racks, overlapping by the rounding of a perceiver
/// (a few micrometres), really overlapping, equal or unequal; e = 0, 1 or between; set off by a disc of their own or by a striker. One in 1000 has 200 discs.
/// On a table of one friction, or of the map's.
inline ClusterTrials run_cluster_trials(const std::string& law, long count, std::uint64_t seed,
                                        const std::shared_ptr<const world::FrictionMap>& map = nullptr) {
  std::mt19937_64 random{seed};
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  const auto impact_law = world::make_impact_law(law);
  ClusterTrials trials;
  for (long i = 0; i < count; ++i) {
    world::WorldSettings settings{.audit = true};
    settings.restitution = i % 7 == 0 ? 0.0 : i % 7 == 1 ? 1.0 : uniform(0.0, 1.0);
    settings.striker_restitution = uniform(0.0, 1.0);
    settings.friction = uniform(0.1, 0.5);
    settings.friction_map = map;
    const bool large = i % 1000 == 999;
    const double largest_gap = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 2e-4 : 5e-3;
    std::vector<Disc> discs;
    if (i % 5 == 4) {
      discs = rack(2 + static_cast<int>(random() % 3), i % 2 == 0 ? 0.0 : 1e-6);
    } else {
      discs =
          random_cluster(random, large ? 200 : 2 + static_cast<int>(random() % 9), largest_gap, 0.02, i % 2 == 0 ? 0.02 : 0.045, i % 4 < 2);
    }
    if (i % 6 == 5) {
      for (Disc& disc : discs) disc.p_WD += Vector2{uniform(-2e-6, 2e-6), uniform(-2e-6, 2e-6)};
    }
    const bool overlap = i % 50 == 49 && discs.size() > 1;
    if (overlap) discs[1].p_WD = discs[0].p_WD + uniform(0.1, 0.98) * (discs[0].radius + discs[1].radius) * Vector2{0.6, 0.8};

    // Racks are struck along their axis.
    const double bearing = i % 5 == 4 ? 0.5 * std::numbers::pi : uniform(-std::numbers::pi, std::numbers::pi);
    const Vector2 direction{std::cos(bearing), std::sin(bearing)};
    Disc& first = *std::min_element(discs.begin(), discs.end(), [&](const Disc& a, const Disc& b) {
      return a.p_WD.dot(direction) - a.radius < b.p_WD.dot(direction) - b.radius;
    });
    world::StrikerRun striker;
    striker.direction = direction;
    striker.speed = uniform(0.2, 2.0);
    striker.cruise = 0.02;
    striker.p_WS = first.p_WD - (first.radius + striker.radius + striker.cruise) * direction;
    striker.mobility = Matrix2::Identity() / 1.2;
    const bool struck = i % 2 == 0;
    if (!struck) first.v_WD_W = striker.speed * direction;

    world::VirtualWorld world{settings, impact_law};
    const auto rollout = world.run(discs, struck ? &striker : nullptr);
    ++trials.rollouts;
    if (overlap) {
      ++trials.overlaps;
      trials.overlaps_refused += rollout ? 0 : 1;
      continue;
    }
    if (!rollout) {
      ++trials.wrongly_refused;
      continue;
    }
    trials.at_rest += rollout->status == world::Rollout::Status::kAtRest ? 1 : 0;
    trials.most_impacts = std::max(trials.most_impacts, rollout->impacts);
    trials.energy_gain = std::max(trials.energy_gain, rollout->energy_gain);
    trials.momentum_error = std::max(trials.momentum_error, rollout->momentum_error);
    trials.smallest_gap = std::min(trials.smallest_gap, rollout->smallest_gap);
  }
  return trials;
}

}  // namespace breakshot::test
