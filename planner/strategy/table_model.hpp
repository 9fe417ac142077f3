#pragma once

#include "common/scene.hpp"
#include "planner/strategy/settings.hpp"
#include "planner/world/disc.hpp"

#include <optional>
#include <string>
#include <vector>

namespace breakshot::strategy {

/// Two discs whose gap is below G.
struct ClosePair {
  std::size_t a = 0, b = 0;     ///< scene indices, a < b
  double gap = 0.0;             ///< m; not negative
  bool contact = false;         ///< near enough for the paper's contours to overlap
  Vector2 middle_W{0.0, 0.0};   ///< middle of the gap
  Vector2 tangent_W{1.0, 0.0};  ///< unit; either of the two ways along the common tangent
  double contour_length = 0.0;  ///< m
};

/// A scene as strategies see it: discs for the virtual world, pairs to be parted, clusters.
struct TableModel {
  std::vector<world::Disc> discs;                  ///< by scene index; overlaps that noise made are parted
  std::vector<ClosePair> pairs;                    ///< every pair with a gap below G
  std::vector<int> cluster;                        ///< by scene index; discs joined by contacts have the same number, 0, 1, ...
  std::vector<int> cluster_size;                   ///< by cluster number
  std::vector<std::vector<std::size_t>> touching;  ///< by scene index: the discs in contact with it

  double smallest_gap() const noexcept;
};

/// Deepest overlap that counts as noise of perception, m; a deeper one is a scene that cannot be.
inline constexpr double kNoiseOverlap = 0.005;

/// Builds the model of a scene; nothing, and why, when the scene cannot be one of discs on a table.
std::optional<TableModel> model_of(const Scene& scene, double min_gap, const StrategySettings& settings, std::string& why_not);

}  // namespace breakshot::strategy
