#include "controller/safety/state_gate.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::safety {

namespace {

/// NaN fails every comparison, so it is out of every range.
bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }

}  // namespace

StateFlaw StateGate::flaw_alone(const JointState& state, Time now) const noexcept {
  const Eigen::Index joints = limits_.joints.joints;
  if (state.q.size() != joints || state.qd.size() != joints || state.tau.size() != joints) return StateFlaw::kWrongJoints;
  for (Eigen::Index i = 0; i < joints; ++i) {
    if (!std::isfinite(state.q[i]) || !std::isfinite(state.qd[i]) || !std::isfinite(state.tau[i])) return StateFlaw::kNotFinite;
    const auto j = static_cast<std::size_t>(i);
    const double max_speed = limits_.speed_factor * limits_.joints.max_speed[j];
    if (!within(state.q[i], limits_.joints.lower[j] - limits_.position_margin, limits_.joints.upper[j] + limits_.position_margin) ||
        !within(state.qd[i], -max_speed, max_speed)) {
      return StateFlaw::kOutOfRange;
    }
  }
  // Compared with now, not subtracted from it: a stamp from outside may be anything, and a difference could overflow.
  if (state.stamp < now - limits_.max_age) return StateFlaw::kLate;
  if (state.stamp > now + limits_.max_ahead) return StateFlaw::kFromFuture;
  return StateFlaw::kNone;
}

StateFlaw StateGate::flaw_after(const Newest& newest, const JointState& state) const noexcept {
  if (state.seq == newest.seq) return StateFlaw::kDuplicate;
  if (state.seq < newest.seq || state.stamp <= newest.stamp) return StateFlaw::kReordered;
  const double span = to_seconds(state.stamp - newest.stamp);
  for (Eigen::Index i = 0; i < limits_.joints.joints; ++i) {
    const auto j = static_cast<std::size_t>(i);
    const double reach = limits_.speed_factor * limits_.joints.max_speed[j] * span + limits_.leap_margin;
    if (std::abs(state.q[i] - newest.q[j]) > reach) return StateFlaw::kLeap;
  }
  return StateFlaw::kNone;
}

void StateGate::take(Newest& newest, const JointState& state) const noexcept {
  newest.session = state.session;
  newest.seq = state.seq;
  newest.stamp = state.stamp;
  for (Eigen::Index i = 0; i < limits_.joints.joints; ++i) newest.q[static_cast<std::size_t>(i)] = state.q[i];
  newest.states = std::min(newest.states + 1, limits_.confirm_session);
}

StateGate::Verdict StateGate::judge_session(const JointState& state) noexcept {
  if (current_.states > 0 && state.session == current_.session) {
    const StateFlaw flaw = flaw_after(current_, state);
    if (flaw == StateFlaw::kNone) {
      take(current_, state);
      candidate_ = {};
    }
    return {flaw, false};
  }
  if (any_replaced_ && state.session == replaced_) return {StateFlaw::kOldSession, false};

  const bool follows = candidate_.states > 0 && state.session == candidate_.session && flaw_after(candidate_, state) == StateFlaw::kNone;
  if (!follows) candidate_ = {};
  take(candidate_, state);
  if (candidate_.states < limits_.confirm_session) return {StateFlaw::kNewSession, false};
  const bool restarted = current_.states > 0;
  if (restarted) {
    replaced_ = current_.session;
    any_replaced_ = true;
  }
  current_ = candidate_;
  candidate_ = {};
  return {StateFlaw::kNone, restarted};
}

StateGate::Verdict StateGate::judge(const JointState& state, Time now) noexcept {
  Verdict verdict{flaw_alone(state, now), false};
  if (verdict.flaw == StateFlaw::kNone) verdict = judge_session(state);
  ++counts_[static_cast<std::size_t>(verdict.flaw)];
  return verdict;
}

const char* to_string(StateFlaw flaw) noexcept {
  switch (flaw) {
    case StateFlaw::kNone: return "good";
    case StateFlaw::kWrongJoints: return "wrong number of joints";
    case StateFlaw::kNotFinite: return "not finite";
    case StateFlaw::kOutOfRange: return "out of range";
    case StateFlaw::kLeap: return "leap";
    case StateFlaw::kNewSession: return "new session";
    case StateFlaw::kOldSession: return "old session";
    case StateFlaw::kDuplicate: return "duplicate";
    case StateFlaw::kReordered: return "reordered";
    case StateFlaw::kLate: return "late";
    case StateFlaw::kFromFuture: return "from the future";
  }
  return "invalid";
}

}  // namespace breakshot::safety
