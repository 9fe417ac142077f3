#pragma once

#include "planner/world/sliding_bodies.hpp"

#include <cstddef>
#include <vector>

namespace breakshot::world {

/// Which two bodies meet next.
///
/// Whoever's motion changed looks at all others, through a bound from below for each (meeting_bounds.hpp), and writes them into its row.
/// A pair is solved only when its bound is the earliest of all, which is seldom wrong: about one solution for each impact. Of two bodies that
/// are to meet it is enough that one knows: the one that moved last.
class Meetings {
 public:
  struct Meeting {
    double time = kNever;
    std::size_t a = 0, b = 0;
  };

  /// Begins anew: nobody meets anybody. Allocates only for more bodies than ever before.
  void reset(const SlidingBodies& bodies);
  /// Body i's motion is another since the last look.
  void look(const SlidingBodies& bodies, std::size_t i, double now) noexcept;
  /// What others know of meetings with bodies whose mark is not 0 holds no longer. The rows of those bodies are theirs to look() for.
  void forget(const std::vector<std::size_t>& bodies, const std::vector<char>& marks) noexcept;
  void forget(std::size_t body) noexcept;

  /// The next meeting, if it is before a given time. `now`: when the bodies are where they are.
  Meeting next(const SlidingBodies& bodies, double now, double before) noexcept;

 private:
  struct Row {
    double bound = kNever;       ///< least of the row's bounds
    std::size_t bound_with = 0;  ///< and whose it is
    double meets = kNever;       ///< earliest meeting that has been solved for
    std::size_t meets_with = 0;
  };
  double* bounds_of(std::size_t i) noexcept { return bounds_[i * width_ / kLanes].values; }
  double& earliest(std::size_t i) noexcept { return earliest_[i / kLanes].values[i % kLanes]; }
  std::size_t place(const double* values) const noexcept;  // of the least in a row
  void find_least(std::size_t i) noexcept;
  void solve(const SlidingBodies& bodies, std::size_t i, double now) noexcept;

  BoundKernels kernels_ = bound_kernels();
  std::size_t width_ = 0;      // of a row
  std::vector<Lanes> bounds_;  // row after row
  std::vector<Row> rows_;
  std::vector<Lanes> earliest_;  // of each row: the lesser of its bound and its meeting
};

}  // namespace breakshot::world
