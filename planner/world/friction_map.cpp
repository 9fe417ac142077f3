#include "planner/world/friction_map.hpp"

#include "planner/world/pair_motion.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace breakshot::world {

namespace {

constexpr double kBehind = 1e-9;  // m; far above the rounding of places on a table

/// The cell of a coordinate, the outermost going on without end.
std::size_t cell_of(double coordinate, double cell, std::size_t count) noexcept {
  return static_cast<std::size_t>(std::clamp(std::floor(coordinate / cell), 0.0, static_cast<double>(count - 1)));
}

/// One coordinate of a straight way: the cell that it is in, and how far it is to the next line between two cells.
class Axis {
 public:
  Axis(double from, double direction, double cell, std::size_t count, std::size_t index) noexcept
      : from_{from}, direction_{direction}, cell_{cell}, count_{count}, index_{index} {}

  double to_next_line() const noexcept {
    const bool up = direction_ > 0.0;
    const bool none = direction_ == 0.0 || (up ? index_ + 1 == count_ : index_ == 0);
    return none ? kNever : (static_cast<double>(index_ + (up ? 1 : 0)) * cell_ - from_) / direction_;
  }
  void cross() noexcept { direction_ > 0.0 ? ++index_ : --index_; }
  std::size_t index() const noexcept { return index_; }

 private:
  double from_, direction_, cell_;
  std::size_t count_, index_;
};

}  // namespace

FrictionMap::FrictionMap(const Vector2& p_WM, double cell, std::size_t columns, std::vector<double> factors)
    : p_WM_{p_WM}, cell_{cell}, columns_{columns}, factors_{std::move(factors)} {
  const auto usable = [](double factor) { return factor > 0.0 && std::isfinite(factor); };
  if (!p_WM.allFinite()) throw std::invalid_argument{"friction map: its corner is not finite"};
  if (!usable(cell)) throw std::invalid_argument{"friction map: cells must be wider than 0"};
  if (columns == 0 || factors_.empty() || factors_.size() % columns != 0)
    throw std::invalid_argument{"friction map: " + std::to_string(factors_.size()) + " cells do not fill rows of " +
                                std::to_string(columns)};
  if (!std::all_of(factors_.begin(), factors_.end(), usable)) throw std::invalid_argument{"friction map: factors must be above 0"};
  rows_ = factors_.size() / columns;
  least_ = *std::min_element(factors_.begin(), factors_.end());
}

FrictionMap::Cell FrictionMap::cell_at(const Vector2& p_W) const noexcept {
  const Vector2 p_MP = p_W - p_WM_;
  return {cell_of(p_MP.x(), cell_, columns_), cell_of(p_MP.y(), cell_, rows_)};
}

double FrictionMap::factor(const Vector2& p_W) const noexcept { return factor_of(cell_at(p_W)); }

FrictionMap::Stretch FrictionMap::stretch(const Vector2& p_W, const Vector2& direction, double longest) const noexcept {
  const Vector2 p_MP = p_W - p_WM_;
  const Cell start = cell_at(p_W);
  Axis x{p_MP.x(), direction.x(), cell_, columns_, start.column};
  Axis y{p_MP.y(), direction.y(), cell_, rows_, start.row};
  double factor = factor_of(start);
  while (true) {
    const double to_x = x.to_next_line(), to_y = y.to_next_line();
    const double length = std::min(to_x, to_y);
    if (length >= longest) return {factor, kNever};
    (to_x < to_y ? x : y).cross();
    const double next = factor_of({x.index(), y.index()});
    if (length <= kBehind) {
      factor = next;
    } else if (next != factor) {
      return {factor, length};
    }
  }
}

}  // namespace breakshot::world
