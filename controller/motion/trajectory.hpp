#pragma once

#include "common/joints.hpp"
#include "common/stroke.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace breakshot::motion {

/// One tick's set-point of every joint.
struct TrajectoryPoint {
  std::array<double, kMaxJoints> q{};    ///< rad
  std::array<double, kMaxJoints> qd{};   ///< rad/s
  std::array<double, kMaxJoints> qdd{};  ///< rad/s^2
  StrokePhase phase = StrokePhase::kTransit;
};

/// A whole stroke - transit, run-in, contact, follow-through, retreat, parking - as one set-point per tick.
/// It begins at rest, or in motion where it takes over from another one.
///
/// Every point was checked against every limit before the real-time thread sees it, and running it is an array look-up. Fixed size
/// (about 2.8 MB): allocated before the loop starts and handed over by pointer.
struct Trajectory {
  static constexpr std::size_t kCapacity = 16384;  ///< ticks; 16.4 s at 1 kHz

  std::uint64_t stroke_id = 0;
  int joints = 0;
  std::size_t size = 0;          ///< ticks in use; the last one is at rest
  std::size_t contact_tick = 0;  ///< where the striker passes StrokeRequest::p_WS; == size for a park
  Duration tick{};               ///< time between points
  std::array<TrajectoryPoint, kCapacity> points;
};

}  // namespace breakshot::motion
