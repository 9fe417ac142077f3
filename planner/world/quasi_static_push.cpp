#include "planner/world/quasi_static_push.hpp"

#include "planner/world/formation.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::world {

namespace {

/// Pairs with a wider gap cannot come to overlap while no disc has gone half of it, m.
constexpr double kNear = 0.010;

}  // namespace

Result<std::span<const Vector2>, WorldInputError> QuasiStaticPush::run(std::span<const Disc> discs, const StrikerRun& run, double length,
                                                                       double allowed_overlap) & {
  if (auto error = check_formation(discs, allowed_overlap)) return WorldInputError{std::move(*error)};
  if (auto error = check_striker(discs, run, allowed_overlap)) return WorldInputError{std::move(*error)};
  if (!(length >= 0.0 && std::isfinite(length))) return WorldInputError{"push: length is not a number of metres"};

  p_WD_.clear();
  radius_.clear();
  for (const Disc& disc : discs) {
    p_WD_.push_back(disc.p_WD);
    radius_.push_back(disc.radius);
  }
  look_who_is_near();
  const int steps = std::max(1, static_cast<int>(std::ceil(length / kPushStep)));
  for (int step = 1; step <= steps; ++step) {
    const Vector2 p_WS = run.p_WS + (length * step / steps) * run.direction;
    // A tenth of a micrometre, or as near as a jam of many discs gets: the next step goes on from there.
    constexpr double kParted = 1e-7;
    constexpr int kSweeps = 200;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      const bool struck = part_from_striker(p_WS, run.radius);
      if (!struck && sweep == 0) break;
      const bool parted = part_from_each_other() < kParted;
      if (someone_went_far()) {
        look_who_is_near();
      } else if (parted) {
        break;
      }
    }
  }
  return std::span<const Vector2>{p_WD_};
}

bool QuasiStaticPush::part_from_striker(const Vector2& p_WS, double radius) noexcept {
  bool struck = false;
  for (std::size_t i = 0; i < p_WD_.size(); ++i) {
    const Vector2 p = p_WD_[i] - p_WS;
    const double reach = radius + radius_[i];
    const double squared = p.squaredNorm();
    if (squared >= reach * reach || squared == 0.0) continue;
    p_WD_[i] = p_WS + (reach / std::sqrt(squared)) * p;
    struck = true;
  }
  return struck;
}

double QuasiStaticPush::part_from_each_other() noexcept {
  double deepest = 0.0;
  for (const Near& pair : near_) {
    Vector2 &p_a = p_WD_[pair.a], &p_b = p_WD_[pair.b];
    const Vector2 p = p_b - p_a;
    const double squared = p.squaredNorm();
    if (squared >= pair.reach * pair.reach || squared == 0.0) continue;
    const double distance = std::sqrt(squared);
    const double overlap = pair.reach - distance;
    const Vector2 half = (0.5 * overlap / distance) * p;
    p_a -= half;
    p_b += half;
    deepest = std::max(deepest, overlap);
  }
  return deepest;
}

void QuasiStaticPush::look_who_is_near() {
  near_.clear();
  for (std::size_t i = 0; i < p_WD_.size(); ++i) {
    for (std::size_t j = i + 1; j < p_WD_.size(); ++j) {
      const double reach = radius_[i] + radius_[j];
      const double within = reach + kNear;
      if ((p_WD_[j] - p_WD_[i]).squaredNorm() < within * within) near_.push_back({i, j, reach});
    }
  }
  p_WD_then_ = p_WD_;
}

bool QuasiStaticPush::someone_went_far() const noexcept {
  constexpr double kFar = 0.5 * kNear;
  for (std::size_t i = 0; i < p_WD_.size(); ++i) {
    if ((p_WD_[i] - p_WD_then_[i]).squaredNorm() > kFar * kFar) return true;
  }
  return false;
}

}  // namespace breakshot::world
