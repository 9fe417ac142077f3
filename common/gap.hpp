#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

namespace breakshot {

/// Smallest gap between any two discs, m, negative where they overlap; infinity with fewer than two. Takes any sequence of values with a centre
/// p_WD and a radius: discs as seen, as they truly are, as a strategy imagines them. Every pair is looked at.
template <typename Discs>
double smallest_gap_between(const Discs& discs) noexcept {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < discs.size(); ++i) {
    for (std::size_t j = i + 1; j < discs.size(); ++j) {
      smallest = std::min(smallest, (discs[i].p_WD - discs[j].p_WD).norm() - discs[i].radius - discs[j].radius);
    }
  }
  return smallest;
}

}  // namespace breakshot
