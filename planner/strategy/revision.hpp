#pragma once

#include "planner/strategy/strategy.hpp"

#include <span>

namespace breakshot::strategy {

/// Share of a decision's rollouts that its correction gets.
inline constexpr double kRevisionPart = 1.0 / 6.0;

/// Whether a stroke is next to one of an earlier decision: the same, or no further from it than its neighbours among the candidates (candidates.cpp) in
/// contact point, direction or speed. Discs that lie a few tenths of a millimetre elsewhere shift the contact point by as much.
bool is_near_any(const StrokeRequest& stroke, std::span<const StrokeOption> earlier) noexcept;

}  // namespace breakshot::strategy
