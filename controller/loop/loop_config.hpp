#pragma once

#include "common/time.hpp"
#include "controller/motion/path_stop.hpp"
#include "controller/safety/following_error.hpp"
#include "controller/safety/freshness.hpp"
#include "controller/safety/joint_setpoint.hpp"
#include "controller/safety/state_gate.hpp"

#include <cstdint>

namespace breakshot::control {

/// All that the control loop is told.
struct LoopConfig {
  safety::JointLimits limits;  ///< max_acceleration: the stops', which is the most that any command may ask
  Duration period = std::chrono::milliseconds{1};
  /// From a tick to when its command is due. A command that travels no longer than that (and the drives' lag) is interpolated to, not
  /// extrapolated from.
  Duration lead = std::chrono::milliseconds{4};
  Duration drive_lag = std::chrono::milliseconds{2};  ///< from when a command is due to when the arm is there
  motion::StopLimits stop;
  safety::FreshnessLimits freshness;
  safety::FollowingLimits following;
  int confirm_session = 5;       ///< see safety::StateLimits
  double position_margin = 0.2;  ///< see safety::StateLimits, rad
  double speed_factor = 2.0;     ///< see safety::StateLimits
  Duration max_state_age = std::chrono::milliseconds{10};
  double give_way_tolerance = 0.005;  ///< a stopped arm that is further than this from its set-point is not pressed on, rad
  double give_way_speed = 0.2;        ///< of the set-point towards such an arm, rad/s
  double rest_speed = 0.02;           ///< measured speed below which a joint counts as at rest, rad/s
  Duration max_settle = std::chrono::milliseconds{500};  ///< a stroke counts as done at the latest so long after its last set-point
  int drive_timeout_ticks = 20;  ///< the drives brake by themselves after so many ticks without a command (common/joints.hpp)
  bool always_answer = false;    ///< goes on commanding standstill when the states are stale, instead of falling silent
  std::uint64_t session = 1;     ///< JointCommand::session
};

/// The same for lockstep mode, where the world waits for an answer to every state: no state is waited for in vain, none is doubted for being the
/// first, and a command is due at the next tick.
LoopConfig lockstep(LoopConfig config) noexcept;

/// What of it concerns the gate for joint states.
safety::StateLimits gate_limits(const LoopConfig& config) noexcept;

}  // namespace breakshot::control
