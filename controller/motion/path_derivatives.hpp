#pragma once

#include "controller/motion/trajectory.hpp"

#include <array>

namespace breakshot::motion {

/// The path at a position between ticks: value, and derivatives by path time (not by wall time).
struct PathDerivatives {
  std::array<double, kMaxJoints> q, d1, d2, d3;
  StrokePhase phase;
};

/// @param position  in ticks, >= 0; past the end counts as the end. Real-time safe.
void path_at(const Trajectory& trajectory, double position, PathDerivatives& out) noexcept;

}  // namespace breakshot::motion
