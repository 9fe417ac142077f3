#pragma once

#include "common/time.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>

namespace breakshot {

/// Most joints that an arm may have here (7-joint arms are the largest in use).
inline constexpr int kMaxJoints = 7;

/// One number per joint, base to tip; rad, rad/s, ... as the name says. Fixed capacity: never allocates.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;

/// What the drives measured. Travels on `cell/joint_state` at 1 kHz.
struct JointState {
  std::uint64_t seq = 0;          ///< counts up by one per tick of the drives; starts anew (with a new session) when they restart
  std::uint64_t session = 0;      ///< random per start of the drives: a changed one means that they restarted
  Time stamp{};                   ///< when measured
  JointVector q;                  ///< rad
  JointVector qd;                 ///< rad/s
  JointVector tau;                ///< drive torque, N m
  std::uint64_t command_seq = 0;  ///< the last command that the drives took; 0 before the first
  bool braked = false;  ///< the drives brake or hold by themselves (no fresh command) and ignore position set-points until one comes
};

/// Set-points for the drives. Travels on `cell/joint_command` at 1 kHz.
///
/// The drives pass `q` with speed `qd` at `due`: between two commands they interpolate, past the newest one they extrapolate at `qd`, and
/// when none came for 20 ms they brake by themselves.
struct JointCommand {
  std::uint64_t seq = 0;      ///< counts up by one per command, from 1
  std::uint64_t session = 0;  ///< random per start of the commander: the drives obey one commander at a time
  std::uint64_t state_seq =
      0;            ///< the newest state that this command knows of; in lockstep mode, the acknowledgement that lets the world go on
  Time due{};       ///< when q and qd are to hold
  JointVector q;    ///< rad
  JointVector qd;   ///< rad/s
  JointVector qdd;  ///< rad/s^2, feed-forward
};

}  // namespace breakshot
