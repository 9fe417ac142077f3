#pragma once

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

  std::size_t size() const noexcept { return x_.size(); }
  Vector2 position(std::size_t i) const noexcept { return {x_[i], y_[i]}; }
  Vector2 velocity(std::size_t i) const noexcept { return {vx_[i], vy_[i]}; }
  double radius(std::size_t i) const noexcept { return radius_[i]; }
  double inverse_mass(std::size_t i) const noexcept { return inverse_mass_[i]; }
  /// Time until the body rests, or its motion is given anew, s.
  double left(std::size_t i) const noexcept { return left_[i]; }
  Motion motion(std::size_t i) const noexcept;

  /// Lets a disc slide until it rests. `deceleration` > 0: mu g, m/s^2.
  void slide(std::size_t i, const Vector2& v, double deceleration) noexcept;
  /// Lets a body move as it is driven; its motion is not known beyond `left`.
  void drive(std::size_t i, const Vector2& v, const Vector2& deceleration, double left) noexcept;

  /// Moves everything on by `dt` >= 0; a driven body by no more than it has left.
  void advance(double dt) noexcept;

  /// When body i next collides with any other, and with which.
  struct Meeting {
    double in = kNever;  ///< s from now
    std::size_t other = kNobody;
  };
  /// Cost: 2 ns for each other body, and some 50 ns for each of the one or two that come into question.
  Meeting next_meeting(std::size_t i) noexcept;

  /// How many other bodies have their rims within `near` of body i's.
  int neighbours(std::size_t i, double near) const noexcept;
  /// The first body at or after `from` whose rim is within `near` of body i's, other than i itself; or kNobody.
  std::size_t next_neighbour(std::size_t i, double near, std::size_t from) const noexcept;

 private:
  std::vector<double> x_, y_;
  std::vector<double> wx_, wy_;  // deceleration, along the velocity
  std::vector<double> left_;
  std::vector<double> vx_, vy_;
  std::vector<double> share_;  // of v * left that the body may still cover: half for a disc, which comes to rest; all for a driven body
  std::vector<double> radius_, inverse_mass_;
  std::vector<double> bound_;  // scratch of next_meeting()
  std::vector<std::size_t> candidate_;
};

}  // namespace breakshot::world
