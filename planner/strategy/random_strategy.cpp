#include "planner/strategy/random_strategy.hpp"

#include "planner/strategy/stroke_room.hpp"

#include <cmath>
#include <numbers>

namespace breakshot::strategy {

namespace {

/// Directions drawn before the strategy gives up; each is tried in the order drawn.
constexpr int kDraws = 40;

/// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every platform, unlike the standard library's distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept : state_{seed} {}
  Vector2 direction() noexcept {
    const double bearing = 2.0 * std::numbers::pi * unit();
    return {std::cos(bearing), std::sin(bearing)};
  }

 private:
  double unit() noexcept {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return static_cast<double>((z ^ (z >> 31U)) >> 11U) * 0x1p-53;
  }

  std::uint64_t state_;
};

}  // namespace

std::vector<HitAim> RandomStrategy::hit_aims(const TableModel& model, int cluster, const DecisionContext& context) const {
  Vector2 centroid{0.0, 0.0};
  for (std::size_t i = 0; i < model.discs.size(); ++i) {
    if (model.cluster[i] == cluster) centroid += model.discs[i].p_WD / model.cluster_size[static_cast<std::size_t>(cluster)];
  }
  Random random{context.seed};
  std::vector<HitAim> aims;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vector2 direction = random.direction();
    const Vector2 outside = centroid - 2.0 * direction;  // further out than any table is wide
    const auto met = first_met(model.discs, outside, direction, settings().cell.striker_radius);
    if (!met) continue;
    aims.push_back(
        {met->disc, outside + met->way * direction, direction, "disc " + std::to_string(met->disc + 1) + " in a random direction"});
  }
  return aims;
}

std::vector<PushAim> RandomStrategy::push_aims(const TableModel& model, const DecisionContext& context) const {
  const auto& cell = settings().cell;
  // The pair that `paper` would take: a contact rather than not, the nearest to the arm.
  std::size_t chosen = 0;
  for (std::size_t k = 1; k < model.pairs.size(); ++k) {
    const ClosePair& one = model.pairs[k];
    const ClosePair& best = model.pairs[chosen];
    const bool nearer = (one.middle_W - cell.p_WB).squaredNorm() < (best.middle_W - cell.p_WB).squaredNorm();
    if (one.contact != best.contact ? one.contact : nearer) chosen = k;
  }
  const ClosePair& pair = model.pairs[chosen];
  Random random{~context.seed};
  std::vector<PushAim> aims;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Vector2 direction = random.direction();
    const Vector2 start = push_start_in_open(model.discs, pair.middle_W, direction, cell.striker_radius, settings().rules.landing_margin);
    aims.push_back({chosen, start, direction, push_length(pair, start, direction),
                    "discs " + std::to_string(pair.a + 1) + "|" + std::to_string(pair.b + 1) + " in a random direction"});
  }
  return aims;
}

}  // namespace breakshot::strategy
