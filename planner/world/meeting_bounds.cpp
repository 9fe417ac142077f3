#include "planner/world/meeting_bounds.hpp"

#include "planner/world/pair_motion.hpp"

// The bodies of the passes are written once, inlined into one function for each width of vectors. They use operators and builtins only: an inline
// function of a library, compiled here for a wide processor, could be the copy that the linker keeps for all others.

namespace breakshot::world {

namespace {

#define BREAKSHOT_INLINE [[gnu::always_inline]] inline

BREAKSHOT_INLINE void advance_all(const ColumnsOf<double>& bodies, double dt) noexcept {
  const std::size_t n = bodies.size;
  double* __restrict x = bodies.x, * __restrict y = bodies.y, * __restrict vx = bodies.vx, * __restrict vy = bodies.vy;
  double* __restrict wx = bodies.wx, * __restrict wy = bodies.wy, * __restrict left = bodies.left, * __restrict travel = bodies.travel;
  const double* __restrict share = bodies.share;
#pragma GCC ivdep
  for (std::size_t i = 0; i < n; ++i) {
    const double vxi = vx[i], vyi = vy[i], wxi = wx[i], wyi = wy[i], left_i = left[i];
    const double s = dt < left_i ? dt : left_i;
    const double left_then = left_i - s;
    // Exactly zero at rest.
    const double moves = left_then > 0.0 ? 1.0 : 0.0;
    x[i] += s * (vxi - 0.5 * s * wxi);
    y[i] += s * (vyi - 0.5 * s * wyi);
    vx[i] = moves * (vxi - s * wxi);
    vy[i] = moves * (vyi - s * wyi);
    wx[i] = moves * wxi;
    wy[i] = moves * wyi;
    left[i] = left_then;
    travel[i] = share[i] * left_then;
  }
}

BREAKSHOT_INLINE void bound_all(const BodyColumns& bodies, std::size_t i, double now, double* __restrict bounds) noexcept {
  const std::size_t n = bodies.size;
  const double* __restrict x = bodies.x, * __restrict y = bodies.y, * __restrict vx = bodies.vx, * __restrict vy = bodies.vy;
  const double* __restrict wx = bodies.wx, * __restrict wy = bodies.wy;
  const double* __restrict left = bodies.left, * __restrict travel = bodies.travel, * __restrict radius = bodies.radius;
  const double xi = x[i], yi = y[i], vxi = vx[i], vyi = vy[i], wxi = wx[i], wyi = wy[i], radius_i = radius[i];
  const double left_i = left[i], travel_i = travel[i];
  const double moves_until_i = left_i > 0.0 ? left_i : kNever;
  const double restx_i = xi + 0.5 * left_i * vxi, resty_i = yi + 0.5 * left_i * vyi;
  // Everything along the line of centres is times the distance, which saves dividing by it.
  for (std::size_t j = 0; j < n; ++j) {
    const double px = x[j] - xi, py = y[j] - yi;
    const double squared = px * px + py * py;
    const double reach = radius[j] + radius_i;
    const double past = squared - reach * __builtin_sqrt(squared);
    const double gap = past > 0.0 ? past : 0.0;
    const double nearing_i = vxi * px + vyi * py;
    const double nearing_j = -(vx[j] * px + vy[j] * py);
    const double closing = nearing_i + nearing_j;
    const double braking = (wxi - wx[j]) * px + (wyi - wy[j]) * py;
    const double radicand = closing * closing - 2.0 * braking * gap;
    const double root = __builtin_sqrt(radicand > 0.0 ? radicand : 0.0);
    const bool nears = closing > 0.0;
    // The first root of closing s - braking s^2 / 2 = gap, in the form that does not cancel.
    const double meets = (nears ? 2.0 * gap : closing - root) / (nears ? closing + root : braking);
    const bool moves_j = left[j] > 0.0;
    const double moves_until_j = moves_j ? left[j] : kNever;
    const double first_rests = moves_until_i < moves_until_j ? moves_until_i : moves_until_j;
    const bool in_time = (radicand >= 0.0) & (nears | (braking < 0.0)) & (meets <= first_rests);

    // Where the one that rests first will lie, seen from the other; the other's way is a straight line.
    const bool j_first = left[j] < left_i;
    const double mx = j_first ? vxi : vx[j], my = j_first ? vyi : vy[j];
    const double restx_j = x[j] + 0.5 * left[j] * vx[j], resty_j = y[j] + 0.5 * left[j] * vy[j];
    const double qx = j_first ? restx_j - xi : restx_i - x[j];
    const double qy = j_first ? resty_j - yi : resty_i - y[j];
    const double aside = qx * my - qy * mx, ahead = qx * mx + qy * my;
    const bool in_way = (aside * aside < reach * reach * (mx * mx + my * my)) & (ahead > 0.0);

    const double ahead_i = nearing_i > 0.0 ? nearing_i : 0.0, ahead_j = nearing_j > 0.0 ? nearing_j : 0.0;
    const bool reaches = ahead_i * travel_i + ahead_j * travel[j] >= gap;
    const bool both_move = moves_j & (left_i > 0.0);
    const bool possible = reaches & (both_move ? in_time | in_way : in_time & in_way);
    bounds[j] = possible ? now + (in_time ? meets : first_rests) : kNever;
  }
  bounds[i] = kNever;
}

BREAKSHOT_INLINE int count_all(const BodyColumns& bodies, std::size_t i, std::size_t j, double near) noexcept {
  const double *x = bodies.x, *y = bodies.y, *radius = bodies.radius;
  const double xi = x[i], yi = y[i], xj = x[j], yj = y[j], reach_i = radius[i] + near, reach_j = radius[j] + near;
  // Counted in eight lanes and in the type of what is compared, so that no addition waits for the one before.
  double counts[kLanes] = {};
  for (std::size_t block = 0; block < bodies.size; block += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t k = block + lane;
      const double pix = x[k] - xi, piy = y[k] - yi, pjx = x[k] - xj, pjy = y[k] - yj;
      const double ri = reach_i + radius[k], rj = reach_j + radius[k];
      counts[lane] += (pix * pix + piy * piy <= ri * ri ? 1.0 : 0.0) + (pjx * pjx + pjy * pjy <= rj * rj ? 1.0 : 0.0);
    }
  }
  double sum = 0.0;
  for (const double count : counts) sum += count;
  return static_cast<int>(sum);
}

// One set of functions for each width.
#define BREAKSHOT_KERNELS(name, ...)                                                                                            \
  __VA_ARGS__ void bound_row_##name(const BodyColumns& bodies, std::size_t i, double now, double* bounds) noexcept {            \
    bound_all(bodies, i, now, bounds);                                                                                          \
  }                                                                                                                             \
  __VA_ARGS__ int count_near_##name(const BodyColumns& bodies, std::size_t i, std::size_t j, double near) noexcept {            \
    return count_all(bodies, i, j, near);                                                                                       \
  }                                                                                                                             \
  __VA_ARGS__ void advance_##name(const ColumnsOf<double>& bodies, double dt) noexcept { advance_all(bodies, dt); }             \
  __VA_ARGS__ std::size_t find_least_##name(const double* values, std::size_t n) noexcept { return place_of_least(values, n); } \
  constexpr BoundKernels name{bound_row_##name, count_near_##name, advance_##name, find_least_##name};

BREAKSHOT_KERNELS(portable)
#if defined(__x86_64__)
BREAKSHOT_KERNELS(avx2, [[gnu::target("avx2")]])
BREAKSHOT_KERNELS(avx512, [[gnu::target("avx512f,avx512dq,avx512vl,prefer-vector-width=512")]])
#endif

}  // namespace

std::span<const BoundKernels> all_bound_kernels() noexcept {
#if defined(__x86_64__)
  static constexpr BoundKernels kAll[] = {avx512, avx2, portable};
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) return kAll;
  return std::span{kAll}.subspan(__builtin_cpu_supports("avx2") ? 1 : 2);
#else
  static constexpr BoundKernels kAll[] = {portable};
  return kAll;
#endif
}

}  // namespace breakshot::world
