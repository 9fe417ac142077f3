#include "planner/world/meetings.hpp"

#include <algorithm>

namespace breakshot::world {

namespace {

constexpr std::size_t kFew = 2 * kLanes;

}  // namespace

void Meetings::reset(const SlidingBodies& bodies) {
  width_ = bodies.columns().size;
  const std::size_t blocks = bodies.size() * width_ / kLanes;
  if (bounds_.size() < blocks) bounds_.resize(blocks);
  rows_.assign(bodies.size(), {});
  Lanes never;
  std::fill(std::begin(never.values), std::end(never.values), kNever);
  earliest_.assign(width_ / kLanes, never);
}

std::size_t Meetings::place(const double* values) const noexcept {
  // A vector that is read right after a part of it was written has to wait; a few numbers are sooner read one by one.
  return width_ <= kFew ? place_of_least(values, width_) : kernels_.find_least(values, width_);
}

void Meetings::find_least(std::size_t i) noexcept {
  Row& row = rows_[i];
  const double* bounds = bounds_of(i);
  row.bound_with = place(bounds);
  row.bound = bounds[row.bound_with];
  earliest(i) = std::min(row.bound, row.meets);
}

void Meetings::look(const SlidingBodies& bodies, std::size_t i, double now) noexcept {
  kernels_.bound_row(bodies.columns(), i, now, bounds_of(i));
  rows_[i].meets = kNever;
  find_least(i);
}

void Meetings::forget(const std::vector<std::size_t>& bodies, const std::vector<char>& marks) noexcept {
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    if (earliest(k) == kNever) continue;
    double* bounds = bounds_of(k);
    for (const std::size_t body : bodies) bounds[body] = kNever;
    Row& row = rows_[k];
    const bool lost_meeting = row.meets < kNever && marks[row.meets_with] != 0;
    if (lost_meeting) row.meets = kNever;
    if (lost_meeting || (row.bound < kNever && marks[row.bound_with] != 0)) find_least(k);
  }
}

void Meetings::forget(std::size_t body) noexcept {
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    if (earliest(k) == kNever) continue;
    bounds_of(k)[body] = kNever;
    if (rows_[k].meets_with == body) rows_[k].meets = kNever;
    find_least(k);
  }
  rows_[body] = {};
  earliest(body) = kNever;
}

void Meetings::solve(const SlidingBodies& bodies, std::size_t i, double now) noexcept {
  Row& row = rows_[i];
  const std::size_t j = row.bound_with;
  double* bounds = bounds_of(i);
  const double meets =
      now + next_collision(bodies.motion(i), bodies.motion(j), bodies.radius(i) + bodies.radius(j), std::max(0.0, row.bound - now));
  // The later of two solved meetings stays in the row: as a bound it holds as well as any.
  if (meets < row.meets) {
    if (row.meets < kNever) bounds[row.meets_with] = row.meets;
    bounds[j] = kNever;
    row.meets = meets;
    row.meets_with = j;
  } else {
    bounds[j] = meets;
  }
  find_least(i);
}

Meetings::Meeting Meetings::next(const SlidingBodies& bodies, double now, double before) noexcept {
  while (true) {
    const std::size_t first = place(earliest_[0].values);
    if (!(earliest(first) < before)) return {};
    const Row& row = rows_[first];
    if (row.meets <= row.bound) return {row.meets, first, row.meets_with};
    solve(bodies, first, now);
  }
}

}  // namespace breakshot::world
