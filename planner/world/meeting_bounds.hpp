#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace breakshot::world {

/// Columns of SlidingBodies hold a multiple of this many, so that passes over them take several at a time without a remainder.
inline constexpr std::size_t kLanes = 8;

/// So many numbers where a vector can begin: none of the passes reads across two lines of the cache.
struct alignas(64) Lanes {
  double values[kLanes];
};

/// What passes over all bodies need of them, one array for each quantity.
template <typename Number>
struct ColumnsOf {
  std::size_t size = 0;                       ///< a multiple of kLanes; what fills it up lies far away, at rest
  Number *x = nullptr, *y = nullptr;          ///< m
  Number *vx = nullptr, *vy = nullptr;        ///< m/s
  Number *wx = nullptr, *wy = nullptr;        ///< deceleration: minus the acceleration, m/s^2; zero at rest
  Number *left = nullptr, *travel = nullptr;  ///< time until it rests, s, and how many times its velocity it goes on by then at most, s
  const double *share = nullptr, *radius = nullptr;  ///< travel / left; m
};
using BodyColumns = ColumnsOf<const double>;

/// bounds[j] = a time that is no later than the next meeting of bodies i and j, and that is some time before it or the meeting itself; kNever
/// when they do not meet. `now` is the time at which the bodies are as the columns say.
///
/// The way between two centres, seen along its direction now, is a parabola while both move, and never longer than the way itself: before
/// its first root they cannot meet. Where that lies beyond the rest of one of them, the bound is the instant of that rest, unless the other,
/// going straight, then misses it or does not come so far. A body that rests now must lie in the other's way.
using BoundRow = void (*)(const BodyColumns& bodies, std::size_t i, double now, double* bounds) noexcept;

/// The number of bodies whose rim is within `near` of body i's or body j's, i and j included, each as often as it is.
using CountNear = int (*)(const BodyColumns& bodies, std::size_t i, std::size_t j, double near) noexcept;

/// Moves everything on by dt >= 0, or until it rests.
using Advance = void (*)(const ColumnsOf<double>& bodies, double dt) noexcept;

/// Where the least of n values is, n being a multiple of kLanes; the values must not be negative. Values that differ by less than one part in
/// 10^11 may count as equal: the bits in which they do are taken for the place, so that nothing branches on what cannot be guessed.
[[gnu::always_inline]] inline std::size_t place_of_least(const double* values, std::size_t n) noexcept {
  constexpr std::int64_t kPlace = 0xFFFF;
  std::int64_t least = INT64_MAX;
  for (std::size_t i = 0; i < n; ++i) {
    std::int64_t bits = 0;  // of numbers that are not negative, the order is that of their bits
    __builtin_memcpy(&bits, values + i, sizeof bits);
    const std::int64_t key = (bits & ~kPlace) | static_cast<std::int64_t>(i);
    least = key < least ? key : least;
  }
  return static_cast<std::size_t>(least & kPlace);
}
using FindLeast = std::size_t (*)(const double* values, std::size_t n) noexcept;

/// All of them, for one width of vectors. All widths give the same bits: each is the same chain of IEEE operations.
struct BoundKernels {
  BoundRow bound_row = nullptr;
  CountNear count_near = nullptr;
  Advance advance = nullptr;
  FindLeast find_least = nullptr;
};

/// Those for the widths that the processor has, the widest first.
std::span<const BoundKernels> all_bound_kernels() noexcept;
inline BoundKernels bound_kernels() noexcept { return all_bound_kernels().front(); }

}  // namespace breakshot::world
