#pragma once

#include "controller/flight/byte_coder.hpp"
#include "controller/loop/flight_tap.hpp"
#include "controller/loop/loop_config.hpp"
#include "controller/loop/loop_memory.hpp"
#include "controller/motion/trajectory.hpp"

// What the loop's plain types consist of, in the order of the file. A change here is a change of the format: FlightRecord's kVersion counts them.

namespace breakshot::control::flight {

inline constexpr std::uint64_t kActions = static_cast<std::uint64_t>(safety::Action::kFault) + 1;
inline constexpr std::uint64_t kPhases = static_cast<std::uint64_t>(StrokePhase::kStopped) + 1;
inline constexpr std::uint64_t kRequestKinds = static_cast<std::uint64_t>(LoopRequest::Kind::kForeignCommander) + 1;

template <typename Code, Is<JointState> T>
void fields(Code& code, T& state) {
  code(state.seq, state.session, state.stamp, state.q, state.qd, state.tau, state.command_seq, state.braked);
}

template <typename Code, Is<JointCommand> T>
void fields(Code& code, T& command) {
  code(command.seq, command.session, command.state_seq, command.due, command.q, command.qd, command.qdd);
}

template <typename Code, Is<safety::Setpoint> T>
void fields(Code& code, T& setpoint) {
  code(setpoint.q, setpoint.qd, setpoint.qdd);
}

template <typename Code, Is<LoopConfig> T>
void fields(Code& code, T& config) {
  auto& limits = config.limits;
  code.below(limits.joints, kMaxJoints + 1);
  code(limits.lower, limits.upper, limits.max_speed, limits.max_acceleration);
  code(config.period, config.lead, config.drive_lag, config.stop.acceleration, config.stop.jerk);
  auto& freshness = config.freshness;
  code(freshness.predict_ticks, freshness.stop_ticks, freshness.stop_after, freshness.recover_samples);
  code(config.following.floor, config.following.per_speed, config.confirm_session, config.position_margin, config.speed_factor,
       config.max_state_age, config.give_way_tolerance, config.give_way_speed, config.rest_speed, config.max_settle,
       config.drive_timeout_ticks, config.always_answer, config.session);
}

template <typename Code, Is<LoopMemory> T>
void fields(Code& code, T& memory) {
  code(memory.gate_, memory.freshness_, memory.following_, memory.fail_safe_, memory.wrong_joints_in_a_row_, memory.foreign_until_);
  code(memory.ticked_, memory.now_, memory.ticks_, memory.skipped_, memory.seq_, memory.anchor_seq_);
  code(memory.state_, memory.past_states_);
  code.below(memory.motion_, LoopMemory::kMotions);
  code(memory.setpoint_, memory.path_stop_, memory.path_pace_, memory.unchecked_, memory.trajectory_number_, memory.cursor_);
  code(memory.next_number_, memory.join_tick_);
  code.below(memory.phase_, kPhases);
  code(memory.contact_pending_, memory.contact_at_, memory.settle_until_, memory.give_way_target_, memory.gave_way_, memory.command_);
}

template <typename Code, Is<RequestRecord> T>
void fields(Code& code, T& request) {
  code.below(request.kind, kRequestKinds);
  code(request.trajectory_number, request.join.number, request.join.tick);
}

template <typename Code, Is<TickRecord> T>
void fields(Code& code, T& record) {
  code(record.tick, record.now, record.came);
  if (record.came) code(record.state);
  code.below(record.requests, kRequestsPerTick + 1);
  for (std::size_t i = 0; i < record.requests; ++i) code(record.request[i]);
  code(record.command);
  code.below(record.action, kActions);
  code(record.causes);
  code.below(record.motion, LoopMemory::kMotions);
  code(record.stroke_id, record.told);
}

template <typename Code, Is<motion::Trajectory> T>
void fields(Code& code, T& trajectory) {
  code(trajectory.stroke_id);
  code.below(trajectory.joints, kMaxJoints + 1);
  code.below(trajectory.size, motion::Trajectory::kCapacity + 1);
  code(trajectory.contact_tick, trajectory.tick);
  for (std::size_t k = 0; k < trajectory.size; ++k) {
    auto& point = trajectory.points[k];
    for (std::size_t j = 0; j < static_cast<std::size_t>(trajectory.joints); ++j) code(point.q[j], point.qd[j], point.qdd[j]);
    code.below(point.phase, kPhases);
  }
}

}  // namespace breakshot::control::flight
