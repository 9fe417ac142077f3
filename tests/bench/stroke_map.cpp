#include "tests/bench/stroke_map.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

std::size_t index(double value, double low, double high) noexcept {
  const double place = (value - low) / (high - low) * static_cast<double>(StrokeMap::kCells);
  return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(StrokeMap::kCells) - 1.0));
}

}  // namespace

void StrokeMap::add(const std::string& layer, const std::vector<Trial>& trials) {
  Layer& into = layers_.emplace_back();
  into.name = layer;
  for (const Trial& trial : trials) {
    const Vector2& p = trial.request.p_WS;
    Cell& cell = into.cells[index(p.y(), area_.min.y(), area_.max.y())][index(p.x(), area_.min.x(), area_.max.x())];
    ++cell.asked;
    if (trial.refusal) continue;
    ++cell.accepted;
    const auto worst = [&](const auto& found, double position) {
      cell.position_mm = std::max(cell.position_mm, 1e3 * position);
      cell.direction_deg = std::max(cell.direction_deg, found.direction_error / kDegree);
      cell.speed_pct = std::max(cell.speed_pct, 100.0 * found.speed_error);
    };
    const bool hit = trial.request.kind == StrokeKind::kHit;
    if (trial.alone) worst(*trial.alone, hit ? trial.alone->position_error : trial.alone->line_deviation);
    if (hit && trial.with_discs && trial.with_discs->touch) worst(*trial.with_discs->touch, trial.with_discs->touch->position_error);
  }
}

void StrokeMap::print() const {
  fmt::print("\nOver the workspace, x from {:.2f} to {:.2f} m, y from {:.2f} (top) to {:.2f} m: accepted %, worst mm, deg, % of speed\n",
             area_.min.x(), area_.max.x(), area_.max.y(), area_.min.y());
  for (const Layer& layer : layers_) {
    fmt::print("{}\n", layer.name);
    for (auto row = layer.cells.rbegin(); row != layer.cells.rend(); ++row) {
      for (const Cell& cell : *row) {
        if (cell.accepted == 0) {
          fmt::print("{:>4.0f}   -    -    -  |", cell.asked > 0 ? 0.0 : NAN);
        } else {
          fmt::print("{:>4.0f} {:.2f} {:.2f} {:.2f} |", 100.0 * cell.accepted / cell.asked, cell.position_mm, cell.direction_deg,
                     cell.speed_pct);
        }
      }
      fmt::print("\n");
    }
  }
}

nlohmann::json StrokeMap::json() const {
  nlohmann::json layers = nlohmann::json::array();
  for (const Layer& layer : layers_) {
    nlohmann::json cells = nlohmann::json::array();
    const Vector2 size = (area_.max - area_.min) / static_cast<double>(kCells);
    for (std::size_t y = 0; y < kCells; ++y) {
      for (std::size_t x = 0; x < kCells; ++x) {
        const Cell& cell = layer.cells[y][x];
        cells.push_back({{"x_m", area_.min.x() + (static_cast<double>(x) + 0.5) * size.x()},
                         {"y_m", area_.min.y() + (static_cast<double>(y) + 0.5) * size.y()},
                         {"asked", cell.asked},
                         {"accepted", cell.accepted},
                         {"position_mm_max", cell.position_mm},
                         {"direction_deg_max", cell.direction_deg},
                         {"speed_pct_max", cell.speed_pct}});
      }
    }
    layers.push_back({{"stroke", layer.name}, {"cells", cells}});
  }
  return layers;
}

}  // namespace breakshot::bench
