#pragma once

#include "common/geometry.hpp"

#include <algorithm>

namespace breakshot {

/// How many discs have their centre outside a region. Takes any sequence of values with a centre p_WD: discs as seen, as a strategy imagines them.
template <typename Discs>
int count_outside(const Discs& discs, const Rect& region) noexcept {
  return static_cast<int>(std::count_if(discs.begin(), discs.end(), [&](const auto& disc) { return !region.contains(disc.p_WD); }));
}

}  // namespace breakshot
