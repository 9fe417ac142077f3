#include "planner/world/sliding_bodies.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::world {

namespace {

constexpr double kFarAway = 1e6;  // m

}  // namespace

void SlidingBodies::resize(std::size_t bodies) {
  size_ = bodies;
  filled_ = std::max<std::size_t>(1, (bodies + kLanes - 1) / kLanes) * kLanes;
  if (columns_.size() < kColumns * filled_ / kLanes) columns_.resize(kColumns * filled_ / kLanes);
  for (std::size_t i = bodies; i < filled_; ++i) take_away(i);
}

void SlidingBodies::place(std::size_t i, const Vector2& p, double radius, double inverse_mass) noexcept {
  column(kX)[i] = p.x();
  column(kY)[i] = p.y();
  for (const Column none : {kVx, kVy, kWx, kWy, kLeft, kTravel}) column(none)[i] = 0.0;
  column(kShare)[i] = kSliding;
  column(kRadius)[i] = radius;
  column(kInverseMass)[i] = inverse_mass;
}

void SlidingBodies::take_away(std::size_t i) noexcept { place(i, {kFarAway, kFarAway}, 0.0, 1.0); }

void SlidingBodies::slide(std::size_t i, const Vector2& v, double deceleration) noexcept {
  const double speed = v.norm();
  const double scale = speed > 0.0 ? deceleration / speed : 0.0;
  move(i, v, scale * v, speed / deceleration, kSliding);
}

void SlidingBodies::drive(std::size_t i, const Vector2& v, const Vector2& deceleration, double left) noexcept {
  move(i, v, deceleration, left, kDriven);
}

void SlidingBodies::move(std::size_t i, const Vector2& v, const Vector2& deceleration, double left, double share) noexcept {
  column(kVx)[i] = v.x();
  column(kVy)[i] = v.y();
  column(kWx)[i] = deceleration.x();
  column(kWy)[i] = deceleration.y();
  column(kLeft)[i] = left;
  column(kTravel)[i] = share * left;
  column(kShare)[i] = share;
}

std::size_t SlidingBodies::next_neighbour(std::size_t i, double near, std::size_t from) const noexcept {
  const double *x = column(kX), *y = column(kY), *radius = column(kRadius);
  for (std::size_t j = from; j < size_; ++j) {
    const double px = x[j] - x[i], py = y[j] - y[i];
    const double reach = radius[i] + near + radius[j];
    if (px * px + py * py <= reach * reach && j != i) return j;
  }
  return kNobody;
}

}  // namespace breakshot::world
