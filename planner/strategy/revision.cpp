#include "planner/strategy/revision.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::strategy {

namespace {

// Just above the steps of candidates.cpp: hits of the same disc 15 degrees apart touch it 10.4 mm apart, and come in six speeds up to 1.2 m/s.
constexpr double kNearPoint = 0.012;  // m
const double kNearDirection = std::cos(0.28);
constexpr double kNearSpeed = 0.19;    // m/s
constexpr double kNearLength = 0.030;  // m, of a push

}  // namespace

bool is_near_any(const StrokeRequest& stroke, std::span<const StrokeOption> earlier) noexcept {
  return std::any_of(earlier.begin(), earlier.end(), [&](const StrokeOption& option) {
    const StrokeRequest& other = option.stroke;
    return stroke.kind == other.kind && (stroke.p_WS - other.p_WS).norm() < kNearPoint &&
           stroke.direction_W.dot(other.direction_W) > kNearDirection && std::abs(stroke.speed - other.speed) < kNearSpeed &&
           std::abs(stroke.length - other.length) < kNearLength;
  });
}

}  // namespace breakshot::strategy
