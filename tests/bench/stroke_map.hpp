#pragma once

#include "tests/bench/stroke_trials.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace breakshot::bench {

/// Acceptance and achieved errors over the workspace: kCells x kCells cells, one layer per kind of stroke.
class StrokeMap {
 public:
  static constexpr std::size_t kCells = 6;

  explicit StrokeMap(const Rect& area) : area_{area} {}

  /// Counts strokes where their p_WS lies.
  void add(const std::string& layer, const std::vector<Trial>& trials);
  /// Per layer a table for people: rows from the far side of the table (+y) down, acceptance and worst error.
  void print() const;
  nlohmann::json json() const;

 private:
  struct Cell {
    int asked = 0, accepted = 0;
    /// Worst of those accepted. Of a hit: at the tick of its contact on an empty table, and at its first touch. Of a push: off its line.
    double position_mm = 0.0, direction_deg = 0.0, speed_pct = 0.0;
  };
  struct Layer {
    std::string name;
    std::array<std::array<Cell, kCells>, kCells> cells;  ///< [y][x]
  };

  Rect area_;
  std::vector<Layer> layers_;
};

}  // namespace breakshot::bench
