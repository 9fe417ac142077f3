#pragma once

#include "common/gap.hpp"
#include "planner/world/disc.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace breakshot::test {

using world::Disc;

inline Disc disc_at(double x, double y, double radius = 0.030) {
  Disc disc;
  disc.p_WD = {x, y};
  disc.radius = radius;
  return disc;
}

/// A billiard rack of `rows` rows with its apex at the origin and its rows along +y; gaps between rows and neighbours are `gap`.
inline std::vector<Disc> rack(int rows, double gap = 0.0, double radius = 0.030) {
  const double pitch = 2.0 * radius + gap;
  std::vector<Disc> discs;
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k <= row; ++k) discs.push_back(disc_at((k - 0.5 * row) * pitch, row * pitch * std::sqrt(3.0) / 2.0, radius));
  }
  return discs;
}

/// A compact cluster about the origin: each disc touches one or, when `compact`, two of those before it, up to a gap drawn from
/// [0, largest_gap].
inline std::vector<Disc> random_cluster(std::mt19937_64& random, int n, double largest_gap = 0.0, double radius_low = 0.030,
                                        double radius_high = 0.030, bool compact = true) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  std::vector<Disc> discs;
  const auto free = [&](const Disc& one) {
    for (const Disc& other : discs) {
      if (gap(one, other) < -1e-12) return false;
    }
    return true;
  };
  while (static_cast<int>(discs.size()) < n) {
    Disc one = disc_at(0.0, 0.0, radius_low < radius_high ? uniform(radius_low, radius_high) : radius_low);
    one.mass = 0.1 * one.radius * one.radius / (0.03 * 0.03);
    if (discs.empty()) {
      discs.push_back(one);
      continue;
    }
    const Disc& a = discs[random() % discs.size()];
    const double to_a = a.radius + one.radius + uniform(0.0, largest_gap);
    if (!compact || discs.size() == 1) {
      const double bearing = uniform(-std::numbers::pi, std::numbers::pi);
      one.p_WD = a.p_WD + to_a * Vector2{std::cos(bearing), std::sin(bearing)};
      if (free(one)) discs.push_back(one);
      continue;
    }
    const Disc& b = discs[random() % discs.size()];
    const double to_b = b.radius + one.radius + uniform(0.0, largest_gap);
    const Vector2 ab = b.p_WD - a.p_WD;
    const double d = ab.norm();
    if (d == 0.0 || d >= to_a + to_b) continue;
    const double along = (d * d + to_a * to_a - to_b * to_b) / (2.0 * d);
    if (along * along >= to_a * to_a) continue;
    const double side = (random() & 1U) != 0U ? 1.0 : -1.0;
    one.p_WD = a.p_WD + along / d * ab + side * std::sqrt(to_a * to_a - along * along) / d * perpendicular(ab);
    if (free(one)) discs.push_back(one);
  }
  Vector2 centre{0.0, 0.0};
  for (const Disc& disc : discs) centre += disc.p_WD / static_cast<double>(n);
  for (Disc& disc : discs) disc.p_WD -= centre;
  return discs;
}

/// Formations in the manner of the paper's figures: A to F of Fig. 3, and those of Figs. 11 to 13. The arm stands towards -x.
inline std::vector<Disc> formation(const std::string& name) {
  const double d = 0.060, h = d * std::sqrt(3.0) / 2.0;
  if (name == "A") return {disc_at(0, -d / 2), disc_at(0, d / 2)};
  if (name == "B") return {disc_at(-h, 0), disc_at(0, -d / 2), disc_at(0, d / 2)};
  if (name == "C") return {disc_at(-h, 0), disc_at(0, -d / 2), disc_at(0, d / 2), disc_at(h, 0)};
  if (name == "D") return {disc_at(-h, -d / 2), disc_at(-h, d / 2), disc_at(0, -d), disc_at(0, 0), disc_at(0, d)};
  std::vector<Disc> six{disc_at(-h, 0), disc_at(0, -d / 2), disc_at(0, d / 2), disc_at(h, -d), disc_at(h, 0), disc_at(h, d)};
  if (name == "F") six[3] = disc_at(0, 1.5 * d);
  if (name == "fig11") six[0].p_WD.x() -= 0.040;
  if (name == "fig12") six = {disc_at(-h, 0), disc_at(0, d / 2), disc_at(0, -d / 2), disc_at(h, 0), disc_at(h, -d), disc_at(2 * h, -d / 2)};
  if (name == "fig13")
    six = {disc_at(0, d / 2), disc_at(0, -d / 2), disc_at(h, d), disc_at(h, 0), disc_at(2 * h, d / 2), disc_at(2 * h, 1.5 * d)};
  return six;
}

/// Discs of unequal radii and masses, apart, sliding in all directions. The same for the same state of `random`.
inline std::vector<Disc> sliding_discs(std::mt19937_64& random, std::size_t n) {
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  std::vector<Disc> discs;
  while (discs.size() < n) {
    Disc disc = disc_at(uniform(-0.2, 0.2), uniform(-0.2, 0.2), uniform(0.02, 0.04));
    disc.mass = uniform(0.05, 0.2);
    disc.v_WD_W = {uniform(-1, 1), uniform(-1, 1)};
    discs.push_back(disc);
    if (smallest_gap_between(discs) < 1e-3) discs.pop_back();
  }
  return discs;
}

}  // namespace breakshot::test
