#include "planner/world/sliding_bodies.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::world {

namespace {

// Values of share_.
constexpr double kSliding = 0.5;
constexpr double kDriven = 1.0;

}  // namespace

void SlidingBodies::resize(std::size_t bodies) {
  for (auto* values : {&x_, &y_, &wx_, &wy_, &left_, &vx_, &vy_, &share_, &radius_, &inverse_mass_, &bound_}) values->resize(bodies);
  candidate_.resize(bodies);
}

void SlidingBodies::place(std::size_t i, const Vector2& p, double radius, double inverse_mass) noexcept {
  x_[i] = p.x();
  y_[i] = p.y();
  wx_[i] = wy_[i] = left_[i] = vx_[i] = vy_[i] = 0.0;
  share_[i] = kSliding;
  radius_[i] = radius;
  inverse_mass_[i] = inverse_mass;
}

Motion SlidingBodies::motion(std::size_t i) const noexcept {
  return {{x_[i], y_[i]}, {vx_[i], vy_[i]}, {-wx_[i], -wy_[i]}, left_[i], share_[i] != kDriven};
}

void SlidingBodies::slide(std::size_t i, const Vector2& v, double deceleration) noexcept {
  const double speed = v.norm();
  const double scale = speed > 0.0 ? deceleration / speed : 0.0;
  wx_[i] = scale * v.x();
  wy_[i] = scale * v.y();
  left_[i] = speed / deceleration;
  vx_[i] = v.x();
  vy_[i] = v.y();
  share_[i] = kSliding;
}

void SlidingBodies::drive(std::size_t i, const Vector2& v, const Vector2& deceleration, double left) noexcept {
  wx_[i] = deceleration.x();
  wy_[i] = deceleration.y();
  left_[i] = left;
  vx_[i] = v.x();
  vy_[i] = v.y();
  share_[i] = kDriven;
}

void SlidingBodies::advance(double dt) noexcept {
  const std::size_t n = size();
  for (std::size_t i = 0; i < n; ++i) {
    const double s = std::min(dt, left_[i]);
    x_[i] += s * (vx_[i] - 0.5 * s * wx_[i]);
    y_[i] += s * (vy_[i] - 0.5 * s * wy_[i]);
    left_[i] -= s;
    // Exactly zero at rest.
    const bool moves = left_[i] > 0.0;
    vx_[i] = moves ? vx_[i] - s * wx_[i] : 0.0;
    vy_[i] = moves ? vy_[i] - s * wy_[i] : 0.0;
  }
}

SlidingBodies::Meeting SlidingBodies::next_meeting(std::size_t i) noexcept {
  const std::size_t n = size();
  const double xi = x_[i], yi = y_[i], vxi = vx_[i], vyi = vy_[i], travel_i = share_[i] * left_[i], radius_i = radius_[i];
  // Plain pointers to arrays that do not overlap, so that the compiler can see that the loop may take several bodies at a time.
  const double* __restrict x = x_.data(), * __restrict y = y_.data(), * __restrict vx = vx_.data(), * __restrict vy = vy_.data();
  const double* __restrict share = share_.data(), * __restrict left = left_.data(), * __restrict radius = radius_.data();
  double* __restrict bounds = bound_.data();
  // A bound from below for each other body: no disc nears another, along the line of their centres now, faster than it does now, nor by more
  // than it does until it rests. All of it times the distance, which saves dividing by it. A body at rest must also lie in i's way.
  const double speed_squared = vxi * vxi + vyi * vyi;
  for (std::size_t j = 0; j < n; ++j) {
    const double px = x[j] - xi, py = y[j] - yi;
    const double squared = px * px + py * py;
    const double reach = radius[j] + radius_i;
    const double gap = std::max(0.0, squared - reach * std::sqrt(squared));
    const double nearing_i = std::max(0.0, vxi * px + vyi * py);
    const double nearing_j = std::max(0.0, -(vx[j] * px + vy[j] * py));
    const double bound = gap / (nearing_i + nearing_j);  // NaN for a pair that touches and does not near: neither of the comparisons holds
    const double aside = px * vyi - py * vxi;
    const bool misses = (left[j] == 0.0) & (aside * aside >= reach * reach * speed_squared);
    const bool reaches = (nearing_i * travel_i + nearing_j * share[j] * left[j] >= gap) & (bound < kNever);
    bounds[j] = reaches & !misses ? bound : kNever;
  }
  bound_[i] = kNever;
  std::size_t candidates = 0;
  for (std::size_t j = 0; j < n; ++j) {
    candidate_[candidates] = j;
    candidates += bound_[j] < kNever ? 1 : 0;
  }

  Meeting first;
  const Motion motion_i = motion(i);
  while (true) {
    std::size_t next = 0;
    double bound = kNever;
    for (std::size_t k = 0; k < candidates; ++k) {
      if (!(bound_[candidate_[k]] < bound)) continue;
      next = k;
      bound = bound_[candidate_[k]];
    }
    if (!(bound < first.in)) return first;
    const std::size_t j = candidate_[next];
    const double in = next_collision(motion_i, motion(j), radius_i + radius_[j]);
    if (in < first.in) first = {in, j};
    candidate_[next] = candidate_[--candidates];
  }
}

int SlidingBodies::neighbours(std::size_t i, double near) const noexcept {
  const std::size_t n = size();
  const double xi = x_[i], yi = y_[i], reach_i = radius_[i] + near;
  const double *x = x_.data(), *y = y_.data(), *radius = radius_.data();
  double count = 0.0;  // in the type of what is compared, so that the loop takes several at a time
  for (std::size_t j = 0; j < n; ++j) {
    const double px = x[j] - xi, py = y[j] - yi;
    const double reach = reach_i + radius[j];
    count += px * px + py * py <= reach * reach ? 1.0 : 0.0;
  }
  return static_cast<int>(count) - 1;
}

std::size_t SlidingBodies::next_neighbour(std::size_t i, double near, std::size_t from) const noexcept {
  const std::size_t n = size();
  const double xi = x_[i], yi = y_[i], reach_i = radius_[i] + near;
  for (std::size_t j = from; j < n; ++j) {
    const double px = x_[j] - xi, py = y_[j] - yi;
    const double reach = reach_i + radius_[j];
    if (px * px + py * py <= reach * reach && j != i) return j;
  }
  return kNobody;
}

}  // namespace breakshot::world
