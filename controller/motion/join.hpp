#pragma once

#include "controller/motion/dip.hpp"
#include "controller/motion/trajectory.hpp"

#include <algorithm>
#include <cstddef>

namespace breakshot::motion {

/// A trajectory's state at a tick within it.
inline MotionState state_at(const Trajectory& trajectory, std::size_t tick) noexcept {
  const TrajectoryPoint& point = trajectory.points[tick];
  const auto joints = static_cast<Eigen::Index>(trajectory.joints);
  return {JointVector::Map(point.q.data(), joints), JointVector::Map(point.qd.data(), joints), JointVector::Map(point.qdd.data(), joints)};
}

/// First tick of a hit or a push from which another stroke may take over: it has left the discs and is at the safe height. Phases come in order.
inline std::size_t first_join(const Trajectory& trajectory) noexcept {
  const auto* const begin = trajectory.points.data();
  const auto* const end = begin + trajectory.size;
  return static_cast<std::size_t>(std::find_if(begin, end, [](const auto& point) { return point.phase == StrokePhase::kParking; }) - begin);
}

}  // namespace breakshot::motion
