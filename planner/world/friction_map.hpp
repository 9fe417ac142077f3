#pragma once

#include "common/geometry.hpp"

#include <cstddef>
#include <vector>

namespace breakshot::world {

/// How friction between discs and table varies from place to place: square cells, each with its factor on WorldSettings::friction. A disc feels the
/// factor at its centre. Beyond the outermost cells theirs go on.
///
/// A disc goes straight through cells, and its speed squared falls linearly with the way in each, so that where, when and how fast it leaves one
/// is known in closed form: VirtualWorld makes an event of it, and nothing is approximated. Cells of equal factors have no border between
/// them, so a map whose factors are rounded costs less.
class FrictionMap {
 public:
  /// @param p_WM    corner of the first cell, with the least x and y, m
  /// @param cell    side of a cell, m, > 0
  /// @param columns  cells along x, >= 1
  /// @param factors  row after row, along x first; > 0, as many as fill the last row
  /// @throws std::invalid_argument
  FrictionMap(const Vector2& p_WM, double cell, std::size_t columns, std::vector<double> factors);

  double factor(const Vector2& p_W) const noexcept;
  double least() const noexcept { return least_; }

  /// The part of a straight way that one factor rules.
  struct Stretch {
    double factor = 1.0;
    double length = 0.0;  ///< until the factor changes, m, > 0; infinity when it does not before `longest`
  };
  /// What lies ahead of a place, along a unit vector, up to a way of `longest`. A border less than 1 nm ahead counts as behind, so that every way is made of
  /// stretches that get on.
  Stretch stretch(const Vector2& p_W, const Vector2& direction, double longest) const noexcept;

 private:
  struct Cell {
    std::size_t column = 0, row = 0;
  };
  Cell cell_at(const Vector2& p_W) const noexcept;
  double factor_of(const Cell& cell) const noexcept { return factors_[cell.row * columns_ + cell.column]; }

  Vector2 p_WM_;
  double cell_;
  std::size_t columns_, rows_ = 0;
  std::vector<double> factors_;
  double least_ = 0.0;
};

}  // namespace breakshot::world
