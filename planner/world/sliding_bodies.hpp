#pragma once

#include "planner/world/meeting_bounds.hpp"
#include "planner/world/pair_motion.hpp"

#include <cstddef>
#include <vector>

namespace breakshot::world {

/// Bodies in motion, all as they are at one instant, "now": the discs, and the striker behind them.
///
/// A disc slides in a straight line with the deceleration mu g until it rests. One array for each quantity, so that passes over all bodies
/// take several at a time.
class SlidingBodies {
 public:
  static constexpr std::size_t kNobody = static_cast<std::size_t>(-1);

  /// Sets how many there are; those that are new have to be placed. Allocates only for more than ever before.
  void resize(std::size_t bodies);
  /// Puts a body at rest.
  void place(std::size_t i, const Vector2& p, double radius, double inverse_mass) noexcept;
  /// Puts a body where it meets nobody.
  void take_away(std::size_t i) noexcept;

  std::size_t size() const noexcept { return size_; }
  BodyColumns columns() const noexcept {
    return {filled_,     column(kX),    column(kY),      column(kVx),    column(kVy),    column(kWx),
            column(kWy), column(kLeft), column(kTravel), column(kShare), column(kRadius)};
  }
  Vector2 position(std::size_t i) const noexcept { return {column(kX)[i], column(kY)[i]}; }
  Vector2 velocity(std::size_t i) const noexcept { return {column(kVx)[i], column(kVy)[i]}; }
  double radius(std::size_t i) const noexcept { return column(kRadius)[i]; }
  double inverse_mass(std::size_t i) const noexcept { return column(kInverseMass)[i]; }
  /// Time until the body rests, or its motion is given anew, s.
  double left(std::size_t i) const noexcept { return column(kLeft)[i]; }
  Motion motion(std::size_t i) const noexcept {
    return {position(i), velocity(i), {-column(kWx)[i], -column(kWy)[i]}, left(i), column(kShare)[i] != kDriven};
  }

  /// Lets a disc slide until it rests. `deceleration` > 0: mu g, m/s^2.
  void slide(std::size_t i, const Vector2& v, double deceleration) noexcept;
  /// Lets a body move as it is driven; its motion is not known beyond `left`.
  void drive(std::size_t i, const Vector2& v, const Vector2& deceleration, double left) noexcept;

  /// Moves everything on by `dt` >= 0; a driven body by no more than it has left.
  void advance(double dt) noexcept {
    kernels_.advance({filled_, column(kX), column(kY), column(kVx), column(kVy), column(kWx), column(kWy), column(kLeft), column(kTravel),
                      column(kShare), column(kRadius)},
                     dt);
  }

  /// The first body at or after `from` whose rim is within `near` of body i's, other than i itself; or kNobody.
  std::size_t next_neighbour(std::size_t i, double near, std::size_t from) const noexcept;

 private:
  // Values of share_.
  static constexpr double kSliding = 0.5;
  static constexpr double kDriven = 1.0;

  void move(std::size_t i, const Vector2& v, const Vector2& deceleration, double left, double share) noexcept;

  enum Column : std::size_t {
    kX,
    kY,
    kVx,
    kVy,
    kWx,  // deceleration, along the velocity
    kWy,
    kLeft,
    kTravel,  // how many times its velocity the body goes on at most: half of what is left for a disc, which comes to rest
    kShare,   // travel / left
    kRadius,
    kInverseMass,
    kColumns,
  };
  const double* column(Column which) const noexcept { return columns_[which * filled_ / kLanes].values; }
  double* column(Column which) noexcept { return columns_[which * filled_ / kLanes].values; }

  BoundKernels kernels_ = bound_kernels();
  std::size_t size_ = 0;
  std::size_t filled_ = 0;      // a multiple of kLanes, filled up with bodies that lie far away; never 0
  std::vector<Lanes> columns_;  // one after the other
};

}  // namespace breakshot::world
