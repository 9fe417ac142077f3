#pragma once

#include "common/config/cell_config.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <cstdint>
#include <random>
#include <vector>

namespace breakshot::bench {

struct SceneOptions {
  int discs_min = 2, discs_max = 12;
  double gap_max = 5e-3;       ///< of a disc to the one that it is put beside, m; drawn evenly from 0
  bool equal_colours = false;  ///< all discs of a scene in one
};

/// Draws what lies on the table. In each scene most discs are put beside another at a random gap, the rest anywhere; in every other scene they are of one
/// size (30 mm when there is room), else of any size from 15 mm on.
class SceneMaker {
 public:
  SceneMaker(const CellConfig& cell, const SceneOptions& options, std::uint32_t seed) : cell_{cell}, options_{options}, random_{seed} {}
  std::vector<sim_bridge::DiscState> make();

 private:
  double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0); }

  const CellConfig& cell_;
  SceneOptions options_;
  std::mt19937 random_;
  int scenes_ = 0;
};

}  // namespace breakshot::bench
