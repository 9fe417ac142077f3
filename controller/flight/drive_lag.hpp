#pragma once

#include "common/result.hpp"
#include "common/time.hpp"
#include "controller/loop/flight_tap.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace breakshot::control::flight {

/// How long after their commands were due the joints were where they say: what `controller.drive_lag_ms` is to be.
struct DriveLag {
  Duration lag{};                    ///< of all joints together
  std::vector<Duration> joint_lag;   ///< of each that moved enough to tell; others: negative
  double residual = 0.0;             ///< rms of what that delay does not explain, rad
  double residual_configured = 0.0;  ///< the same for the delay that was asked about, rad
  std::size_t states = 0;            ///< that were compared
};

/// Shifts what was measured on trajectories over what was commanded until the two agree best (least squares; a scan by milliseconds, then
/// Gauss and Newton's method). Between commands the set-point is the cubic that common/joints.hpp asks of the drives.
///
/// @param ticks       one after another, as recorded
/// @param configured  LoopConfig::drive_lag
/// @return or why these ticks do not tell: too little motion
Result<DriveLag, std::string> find_drive_lag(std::span<const TickRecord> ticks, Duration configured);

}  // namespace breakshot::control::flight
