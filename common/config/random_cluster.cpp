#include "common/config/config_value.hpp"
#include "common/config/formation.hpp"
#include "common/scene.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace breakshot {
namespace {

using detail::throw_config_error;

// A whole cluster that does not fit into the workspace is thrown away and drawn anew; the next draw of a cluster that nearly always fits
// fits, one that never does (64 large discs) shows within a fraction of a second.
constexpr int kMaxDraws = 64;
// Directions tried for a chain's next disc before it goes where there is room.
constexpr int kMaxDirections = 16;

/// A unit vector of uniform direction, by rejection from the square: no sine, so the same bits everywhere.
Vector2 random_direction(SplitMix64& random) {
  for (;;) {
    const double x = random.uniform(-1.0, 1.0);
    const double y = random.uniform(-1.0, 1.0);
    const double square = x * x + y * y;
    if (square <= 1.0 && square > 1e-4) return Vector2{x, y} / std::sqrt(square);
  }
}

bool is_free(const std::vector<FormationDisc>& discs, const Vector2& p, double radius) {
  return std::all_of(discs.begin(), discs.end(), [&](const FormationDisc& disc) {
    // Below rounding of the sums above it, so that a place that touches a third disc exactly stays allowed.
    return (p - disc.p_WD).norm() >= disc.radius + radius - 1e-12;
  });
}

/// Where a disc touches both a and b: at most two places.
void add_places_between(const FormationDisc& a, const FormationDisc& b, double radius, std::vector<Vector2>& places) {
  const double to_a = a.radius + radius;
  const double to_b = b.radius + radius;
  const Vector2 p_AB = b.p_WD - a.p_WD;
  const double apart = p_AB.norm();
  if (apart >= to_a + to_b) return;
  const double along = (apart * apart + to_a * to_a - to_b * to_b) / (2.0 * apart);
  const double square = to_a * to_a - along * along;
  if (square < 0.0) return;
  const Vector2 n = p_AB / apart;
  const Vector2 foot = a.p_WD + along * n;
  const Vector2 aside = std::sqrt(square) * perpendicular(n);
  places.emplace_back(foot + aside);
  places.emplace_back(foot - aside);
}

/// A free place that touches two discs: of two drawn, the one nearer to the middle of the cluster.
std::optional<Vector2> place_between(const std::vector<FormationDisc>& discs, double radius, SplitMix64& random) {
  std::vector<Vector2> places;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    for (std::size_t j = i + 1; j < discs.size(); ++j) add_places_between(discs[i], discs[j], radius, places);
  }
  std::erase_if(places, [&](const Vector2& p) { return !is_free(discs, p, radius); });
  if (places.empty()) return std::nullopt;
  Vector2 middle{0.0, 0.0};
  for (const FormationDisc& disc : discs) middle += disc.p_WD / static_cast<double>(discs.size());
  const Vector2& first = places[random.below(places.size())];
  const Vector2& second = places[random.below(places.size())];
  return (first - middle).squaredNorm() <= (second - middle).squaredNorm() ? first : second;
}

/// A free place that touches the newest disc.
std::optional<Vector2> place_at_end(const std::vector<FormationDisc>& discs, double radius, SplitMix64& random) {
  const FormationDisc& last = discs.back();
  for (int i = 0; i < kMaxDirections; ++i) {
    const Vector2 p = last.p_WD + (last.radius + radius) * random_direction(random);
    if (is_free(discs, p, radius)) return p;
  }
  return std::nullopt;
}

/// Colours in random order, so that no two discs share one while there are enough.
std::vector<std::uint8_t> shuffled_colours(std::size_t count, SplitMix64& random) {
  std::vector<std::uint8_t> colours(count);
  for (std::size_t i = 0; i < count; ++i) colours[i] = static_cast<std::uint8_t>(i);
  for (std::size_t i = count; i > 1; --i) std::swap(colours[i - 1], colours[random.below(i)]);
  return colours;
}

std::vector<FormationDisc> draw(const RandomCluster& cluster, std::size_t colour_count, SplitMix64 random) {
  const std::vector<std::uint8_t> colours = shuffled_colours(colour_count, random);
  std::vector<FormationDisc> discs;
  for (int i = 0; i < cluster.discs; ++i) {
    FormationDisc disc;
    disc.radius = random.uniform(cluster.radius_min, cluster.radius_max);
    disc.colour = colours[static_cast<std::size_t>(i) % colours.size()];
    if (!discs.empty()) {
      const bool nestle = random.uniform() < cluster.compact;
      std::optional<Vector2> p = nestle ? place_between(discs, disc.radius, random) : place_at_end(discs, disc.radius, random);
      // The second disc has no two to nestle between; a chain may have run into a corner.
      if (!p) p = nestle ? place_at_end(discs, disc.radius, random) : place_between(discs, disc.radius, random);
      if (!p) return {};
      disc.p_WD = *p;
    }
    discs.push_back(disc);
  }
  return discs;
}

/// Puts the middle of the bounding box of the centres into the middle of the workspace.
void centre(std::vector<FormationDisc>& discs, const Rect& workspace) {
  Rect box{discs.front().p_WD, discs.front().p_WD};
  for (const FormationDisc& disc : discs) {
    box.min = box.min.cwiseMin(disc.p_WD);
    box.max = box.max.cwiseMax(disc.p_WD);
  }
  const Vector2 shift = 0.5 * (workspace.min + workspace.max) - 0.5 * (box.min + box.max);
  for (FormationDisc& disc : discs) disc.p_WD += shift;
}

}  // namespace

Formation random_cluster(const RandomCluster& cluster, const CellConfig& cell) {
  const std::string place = "random cluster";
  const auto refuse_unless = [&](bool good, const std::string& key, const std::string& allowed) {
    if (!good) throw_config_error(place, key, "a value out of range", allowed);
  };
  refuse_unless(cluster.discs >= 1 && cluster.discs <= static_cast<int>(kMaxSceneDiscs), "n", "1 to " + std::to_string(kMaxSceneDiscs));
  refuse_unless(cluster.compact >= 0.0 && cluster.compact <= 1.0, "compact", "[0, 1]");
  refuse_unless(
      cluster.radius_min >= cell.disc_radius_min && cluster.radius_max <= cell.disc_radius_max && cluster.radius_min <= cluster.radius_max,
      "rmin, rmax", "rmin <= rmax, both in cell.disc_radius");

  Formation formation;
  formation.name = "random";
  formation.description = "random cluster of " + std::to_string(cluster.discs) + " touching discs, seed " + std::to_string(cluster.seed);
  SplitMix64 random{cluster.seed};
  for (int i = 0; i < kMaxDraws; ++i) {
    formation.discs = draw(cluster, cell.colours.size(), random.split());
    if (formation.discs.empty()) continue;
    centre(formation.discs, cell.workspace);
    const bool fits = std::all_of(formation.discs.begin(), formation.discs.end(), [&](const FormationDisc& disc) {
      return cell.workspace.margin(disc.p_WD) >= disc.radius;  // the whole disc, so that the camera sees all of it
    });
    if (!fits) continue;
    check_formation(formation, cell, place);
    return formation;
  }
  throw_config_error(place, "n", "discs that do not fit into the workspace in " + std::to_string(kMaxDraws) + " draws",
                     "fewer or smaller discs, or a higher `compact`");
}

void jitter(Formation& formation, SplitMix64& random, double max_gap) {
  auto& discs = formation.discs;
  if (discs.size() < 2) return;
  Vector2 middle{0.0, 0.0};
  double smallest = discs.front().radius;
  for (const FormationDisc& disc : discs) {
    middle += disc.p_WD / static_cast<double>(discs.size());
    smallest = std::min(smallest, disc.radius);
  }
  // Stretched by this, two touching discs of the smallest radius part by max_gap / 2 and all others by more; the two random moves of a
  // quarter each can take that back or double it.
  const double stretch = 0.5 * max_gap / (2.0 * smallest);
  for (FormationDisc& disc : discs) {
    disc.p_WD += stretch * (disc.p_WD - middle);
    disc.p_WD += 0.25 * max_gap * random.uniform() * random_direction(random);
  }
}

}  // namespace breakshot
