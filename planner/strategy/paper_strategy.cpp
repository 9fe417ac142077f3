#include "planner/strategy/paper_strategy.hpp"

#include "planner/strategy/stroke_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace breakshot::strategy {

namespace {

/// Beyond 46.1 degrees off the axis the far disc of a simultaneous impact gets nothing (errata.md, row (11)-(13)): cos of twice that.
constexpr double kSimultaneousSpread = -0.0384;

/// A cue disc meets two discs at once when its ways to them differ by no more than what the camera resolves, m.
constexpr double kSameWay = 0.002;

std::string name_of(std::size_t disc) { return std::to_string(disc + 1); }

/// Discs that a struck disc meets: those in contact with it or, for a cue disc, those of the cluster within reach and in sight of it.
std::vector<std::size_t> discs_ahead(const TableModel& model, std::size_t struck, int cluster, double cue_gap) {
  if (model.cluster[struck] == cluster) return model.touching[struck];
  std::vector<std::size_t> ahead;
  for (std::size_t i = 0; i < model.discs.size(); ++i) {
    if (model.cluster[i] != cluster || gap(model.discs[struck], model.discs[i]) > cue_gap) continue;
    const Vector2 way = model.discs[i].p_WD - model.discs[struck].p_WD;
    const double free_way = way.norm() - model.discs[struck].radius - model.discs[i].radius;
    bool in_sight = true;
    for (std::size_t k = 0; k < model.discs.size() && in_sight; ++k) {
      if (k == struck || k == i) continue;
      const Vector2 end = model.discs[struck].p_WD + free_way * way.normalized();
      in_sight = distance_to_segment(model.discs[k].p_WD, model.discs[struck].p_WD, end) >=
                 model.discs[struck].radius + model.discs[k].radius - kSameWay;
    }
    if (in_sight) ahead.push_back(i);
  }
  return ahead;
}

}  // namespace

std::vector<HitAim> PaperStrategy::hit_aims(const TableModel& model, int cluster, const DecisionContext& /*context*/) const {
  const auto& cell = settings().cell;
  Vector2 centroid{0.0, 0.0};
  for (std::size_t i = 0; i < model.discs.size(); ++i) {
    if (model.cluster[i] == cluster) centroid += model.discs[i].p_WD / model.cluster_size[static_cast<std::size_t>(cluster)];
  }

  struct Ranked {
    HitAim aim;
    bool away_from_arm;
    double arm_distance;  // of the struck disc
    bool simultaneous;
    double into_cluster;  // cosine between the direction and the way to the cluster's middle
  };
  std::vector<Ranked> ranked;
  for (std::size_t i = 0; i < model.discs.size(); ++i) {
    const auto ahead = discs_ahead(model, i, cluster, settings().rules.cue_gap);
    const auto add = [&](const Vector2& direction, const std::string& what, bool simultaneous) {
      HitAim aim{i, central_contact(model.discs[i], direction, cell.striker_radius), direction, what};
      const Vector2 from_arm = aim.p_WS - cell.p_WB;
      const Vector2 inward = centroid - model.discs[i].p_WD;
      const double into = inward.norm() > 1e-6 ? direction.dot(inward.normalized()) : 0.0;
      ranked.push_back({std::move(aim), direction.dot(from_arm) > 0.0, (model.discs[i].p_WD - cell.p_WB).norm(), simultaneous, into});
    };
    for (std::size_t k = 0; k < ahead.size(); ++k) {
      const Vector2 to_k = model.discs[ahead[k]].p_WD - model.discs[i].p_WD;
      const Vector2 n_k = to_k.normalized();
      add(n_k, "disc " + name_of(i) + " onto " + name_of(ahead[k]) + " (central impact)", false);
      for (std::size_t l = 0; l < k; ++l) {
        const Vector2 to_l = model.discs[ahead[l]].p_WD - model.discs[i].p_WD;
        const Vector2 n_l = to_l.normalized();
        const double ways_differ = std::abs((to_k.norm() - model.discs[ahead[k]].radius) - (to_l.norm() - model.discs[ahead[l]].radius));
        if (n_k.dot(n_l) < kSimultaneousSpread) continue;
        if (model.cluster[i] != cluster && ways_differ > kSameWay) continue;
        add((n_k + n_l).normalized(),
            "disc " + name_of(i) + " between " + name_of(ahead[l]) + " and " + name_of(ahead[k]) + " (simultaneous impact)", true);
      }
    }
  }
  // From the arm's side, the disc nearest to the arm first; two discs at once rather than one; into the cluster rather than along its rim.
  std::stable_sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) {
    if (a.away_from_arm != b.away_from_arm) return a.away_from_arm;
    if (a.arm_distance != b.arm_distance) return a.arm_distance < b.arm_distance;
    if (a.simultaneous != b.simultaneous) return a.simultaneous;
    return a.into_cluster > b.into_cluster;
  });
  std::vector<HitAim> aims;
  for (Ranked& one : ranked) aims.push_back(std::move(one.aim));
  return aims;
}

std::vector<PushAim> PaperStrategy::push_aims(const TableModel& model, const DecisionContext& /*context*/) const {
  const auto& cell = settings().cell;
  const auto& rules = settings().rules;
  std::vector<std::size_t> order(model.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  // Contacts before pairs that are merely too near; among equals the one nearest to the arm.
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const ClosePair& first = model.pairs[a];
    const ClosePair& second = model.pairs[b];
    if (first.contact != second.contact) return first.contact;
    return (first.middle_W - cell.p_WB).squaredNorm() < (second.middle_W - cell.p_WB).squaredNorm();
  });

  std::vector<PushAim> aims;
  for (const std::size_t index : order) {
    const ClosePair& pair = model.pairs[index];
    // Of the two ways along the tangent, the one that begins nearer to the arm leads away from it.
    const Vector2 away = pair.tangent_W.dot(pair.middle_W - cell.p_WB) >= 0.0 ? pair.tangent_W : Vector2{-pair.tangent_W};
    for (const bool from_arm : {true, false}) {
      const Vector2 direction = from_arm ? away : Vector2{-away};
      const auto start =
          push_start_at_pair(model.discs, pair.a, pair.b, pair.middle_W, direction, cell.striker_radius, rules.landing_margin);
      if (!start) continue;
      aims.push_back({index, *start, direction, push_length(pair, *start, direction),
                      "discs " + name_of(pair.a) + "|" + name_of(pair.b) + (from_arm ? " from the arm's side" : " from the far side")});
    }
  }
  return aims;
}

}  // namespace breakshot::strategy
