#include "planner/strategy/table_model.hpp"

#include "common/gap.hpp"
#include "planner/world/formation.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::strategy {

namespace {

/// Perception's push line is taken when it agrees with the geometric tangent within this; Fig. 12e of the paper shows a false contour.
constexpr double kTangentAgreement = 0.985;  // cos(10 deg)

/// Length of the lens in which two discs overlap when their contours are thickened: the contour that perception would find.
double lens_length(const world::Disc& a, const world::Disc& b, double gap, double thickness) noexcept {
  const double R = 0.5 * (a.radius + b.radius);
  const double reach = R + thickness;
  const double half = R + 0.5 * gap;
  return reach > half ? 2.0 * std::sqrt(reach * reach - half * half) : 0.0;
}

void find_clusters(TableModel& model) {
  const std::size_t n = model.discs.size();
  model.cluster.assign(n, -1);
  std::vector<std::size_t> open;
  for (std::size_t start = 0; start < n; ++start) {
    if (model.cluster[start] >= 0) continue;
    const int number = static_cast<int>(model.cluster_size.size());
    model.cluster_size.push_back(0);
    open.assign(1, start);
    model.cluster[start] = number;
    while (!open.empty()) {
      const std::size_t disc = open.back();
      open.pop_back();
      ++model.cluster_size[static_cast<std::size_t>(number)];
      for (const std::size_t other : model.touching[disc]) {
        if (model.cluster[other] >= 0) continue;
        model.cluster[other] = number;
        open.push_back(other);
      }
    }
  }
}

}  // namespace

double TableModel::smallest_gap() const noexcept { return smallest_gap_between(discs); }

std::optional<TableModel> model_of(const Scene& scene, double min_gap, const StrategySettings& settings, std::string& why_not) {
  TableModel model;
  const auto& cell = settings.cell;
  for (const SceneDisc& seen : scene.discs) {
    world::Disc disc;
    disc.p_WD = seen.p_WD;
    disc.radius = seen.radius;
    disc.mass = cell.disc_mass * (seen.radius * seen.radius) / (cell.disc_radius * cell.disc_radius);
    model.discs.push_back(disc);
  }
  if (auto error = world::check_formation(model.discs, kNoiseOverlap)) {
    why_not = "the scene cannot be: " + *error;
    return std::nullopt;
  }
  world::part_overlaps(model.discs);

  const std::size_t n = model.discs.size();
  model.touching.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const auto& a = model.discs[i];
      const auto& b = model.discs[j];
      const double gap_now = std::max(0.0, gap(a, b));
      if (gap_now >= min_gap) continue;
      ClosePair pair;
      pair.a = i;
      pair.b = j;
      pair.gap = gap_now;
      pair.contact = gap_now <= settings.rules.contact_gap;
      const Vector2 n_AB = (b.p_WD - a.p_WD).normalized();
      pair.middle_W = a.p_WD + (a.radius + 0.5 * gap_now) * n_AB;
      pair.tangent_W = perpendicular(n_AB);
      // A pair whose contours do not overlap gets the contour of one that touches: the push is to go as far beyond its middle.
      pair.contour_length = lens_length(a, b, pair.contact ? gap_now : 0.0, settings.rules.contour_thickness);
      for (const SceneContact& contact : scene.contacts) {
        if (contact.a != i || contact.b != j) continue;
        if (std::abs(contact.push_direction_W.dot(pair.tangent_W)) < kTangentAgreement || !(contact.contour_length > 0.0)) continue;
        pair.tangent_W = contact.push_direction_W.normalized();
        pair.contour_length = contact.contour_length;
      }
      if (pair.contact) {
        model.touching[i].push_back(j);
        model.touching[j].push_back(i);
      }
      model.pairs.push_back(pair);
    }
  }
  find_clusters(model);
  return model;
}

}  // namespace breakshot::strategy
