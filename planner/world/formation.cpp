#include "planner/world/formation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace breakshot::world {

namespace {

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string text_of(const char* format, ...) {
  char buffer[200];
  std::va_list values;
  va_start(values, format);
  std::vsnprintf(buffer, sizeof buffer, format, values);
  va_end(values);
  return buffer;
}

}  // namespace

std::optional<std::string> check_formation(std::span<const Disc> discs, double allowed_overlap) {
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const Disc& disc = discs[i];
    if (!disc.p_WD.allFinite() || !disc.v_WD_W.allFinite()) return text_of("disc %zu: position or velocity is not finite", i);
    if (!(disc.radius > 0.0 && std::isfinite(disc.radius))) return text_of("disc %zu: radius %g m; allowed: above 0", i, disc.radius);
    if (!(disc.mass > 0.0 && std::isfinite(disc.mass))) return text_of("disc %zu: mass %g kg; allowed: above 0", i, disc.mass);
    for (std::size_t j = 0; j < i; ++j) {
      const double reach = disc.radius + discs[j].radius - allowed_overlap;
      const double squared = (disc.p_WD - discs[j].p_WD).squaredNorm();
      if (reach > 0.0 && squared < reach * reach) {
        return text_of("discs %zu and %zu overlap by %.3f mm; allowed: %.3f mm", j, i, -1e3 * gap(discs[j], disc), 1e3 * allowed_overlap);
      }
    }
  }
  return std::nullopt;
}

std::optional<std::string> check_striker(std::span<const Disc> discs, const StrikerRun& striker, double allowed_overlap) {
  if (!striker.p_WS.allFinite()) return "striker: position is not finite";
  if (!(std::abs(striker.direction.norm() - 1.0) < 1e-6)) return "striker: direction is not of unit length";
  if (!(striker.speed > 0.0 && std::isfinite(striker.speed))) return text_of("striker: speed %g m/s; allowed: above 0", striker.speed);
  if (!(striker.cruise >= 0.0 && std::isfinite(striker.cruise)))
    return text_of("striker: cruise %g m; allowed: 0 or above", striker.cruise);
  if (!(striker.braking > 0.0)) return text_of("striker: braking %g m/s^2; allowed: above 0", striker.braking);
  if (!(striker.lift > 0.0)) return text_of("striker: lift %g s; allowed: above 0", striker.lift);
  if (!(striker.radius > 0.0)) return text_of("striker: radius %g m; allowed: above 0", striker.radius);
  const Matrix2& mobility = striker.mobility;
  if (!(mobility.trace() >= 0.0 && mobility.determinant() >= 0.0 && mobility.allFinite())) return "striker: mobility must not be negative";
  if (!(striker.bandwidth >= 0.0)) return text_of("striker: bandwidth %g rad/s; allowed: 0 or above", striker.bandwidth);
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const double overlap = discs[i].radius + striker.radius - (discs[i].p_WD - striker.p_WS).norm();
    if (overlap > allowed_overlap) return text_of("striker starts inside disc %zu by %.3f mm", i, 1e3 * overlap);
  }
  return std::nullopt;
}

double part_overlaps(std::vector<Disc>& discs) {
  constexpr double kResolved = 1e-9;
  constexpr int kSweeps = 2000;
  double deepest = 0.0;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double left = 0.0;
    for (std::size_t i = 0; i < discs.size(); ++i) {
      for (std::size_t j = i + 1; j < discs.size(); ++j) {
        const Vector2 p = discs[j].p_WD - discs[i].p_WD;
        const double distance = p.norm();
        const double overlap = discs[i].radius + discs[j].radius - distance;
        if (overlap <= kResolved) continue;
        left = std::max(left, overlap);
        const Vector2 n = distance > 0.0 ? Vector2{p / distance} : Vector2{1.0, 0.0};
        discs[i].p_WD -= 0.5 * overlap * n;
        discs[j].p_WD += 0.5 * overlap * n;
      }
    }
    if (sweep == 0) deepest = left;
    if (left <= kResolved) break;
  }
  return deepest;
}

}  // namespace breakshot::world
