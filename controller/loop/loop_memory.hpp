#pragma once

#include "common/joints.hpp"
#include "common/stroke.hpp"
#include "controller/loop/loop_config.hpp"
#include "controller/motion/path_pace.hpp"
#include "controller/motion/path_stop.hpp"
#include "controller/motion/trajectory.hpp"
#include "controller/safety/fail_safe.hpp"
#include "controller/safety/following_error.hpp"
#include "controller/safety/freshness.hpp"
#include "controller/safety/joint_setpoint.hpp"
#include "controller/safety/state_gate.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace breakshot::control {

/// All that a tick of the control loop leaves to the next one. In one piece, so that the flight recorder can keep it and a replay start from it;
/// with the configuration and what comes in, it determines every later command.
struct LoopMemory {
  enum class Motion : std::uint8_t {
    kReleased = 0,  ///< no set-point: waits for a measured position to start from; nothing is sent
    kBraking = 1,   ///< every joint to rest by itself
    kHolding = 2,   ///< stands still
    kOnTrajectory = 3,
    kStoppingOnPath = 4,
    kSettling = 5,   ///< the trajectory has ended; the arm is coming to rest
    kGivingWay = 6,  ///< in a stop: the set-point goes to where the arm is
    kPaced = 7,      ///< on the trajectory at a path speed of its own: slowing on prediction, going on from there, or stopping from there
  };
  static constexpr unsigned kMotions = 8;

  explicit LoopMemory(const LoopConfig& config) noexcept
      : gate_{gate_limits(config)},
        freshness_{config.freshness},
        following_{config.limits.joints, config.following},
        path_stop_{config.stop},
        path_pace_{config.stop} {}

  safety::StateGate gate_;
  safety::FreshnessWatchdog freshness_;
  safety::FollowingMonitor following_;
  safety::FailSafe fail_safe_;
  int wrong_joints_in_a_row_ = 0;
  Time foreign_until_{};

  bool ticked_ = false;
  Time now_{};
  std::uint64_t ticks_ = 0;
  std::uint64_t skipped_ = 0;
  std::uint64_t seq_ = 0;         ///< of the last command
  std::uint64_t anchor_seq_ = 0;  ///< of the first command since the set-point was last anchored

  static constexpr std::size_t kPastStates = 6;
  JointState state_;                                 ///< the newest good one
  std::array<JointState, kPastStates> past_states_;  ///< the good ones before, newest first; same session

  Motion motion_ = Motion::kReleased;
  safety::Setpoint setpoint_;
  motion::PathStop path_stop_;
  motion::PathPace path_pace_;
  bool unchecked_ = false;  ///< the set-point was anchored: the next one has no predecessor to be held against

  const motion::Trajectory* trajectory_ = nullptr;
  std::uint64_t trajectory_number_ = 0;                  ///< LoopRequest::trajectory_number of `trajectory_`; 0: none
  std::int64_t cursor_ = -1;                             ///< index of the last set-point sent; -1: none yet
  const motion::Trajectory* next_trajectory_ = nullptr;  ///< takes over from `trajectory_`, which is on its way at its own pace
  std::uint64_t next_number_ = 0;                        ///< of it; 0: none
  std::int64_t join_tick_ = 0;                           ///< of `trajectory_`: there it takes over
  StrokePhase phase_ = StrokePhase::kAccepted;
  bool contact_pending_ = false;
  Time contact_at_{};  ///< when the arm is to pass the contact point
  Time settle_until_{};
  safety::JointArray give_way_target_{};
  bool gave_way_ = false;  ///< in this stop; only once, because an arm that runs away from its set-point must not be chased

  JointCommand command_;  ///< the last one
};

}  // namespace breakshot::control
