#include "controller/safety/state_gate.hpp"

#include <cmath>

namespace breakshot::safety {

namespace {

/// NaN fails every comparison, so it is out of every range.
bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }

}  // namespace

StateFlaw StateGate::flaw_of(const JointState& state, Time now) const noexcept {
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
  if (any_ && state.session == session_) {
    if (state.seq == seq_) return StateFlaw::kDuplicate;
    if (state.seq < seq_ || state.stamp <= stamp_) return StateFlaw::kReordered;
  } else if (has_previous_session_ && state.session == previous_session_) {
    return StateFlaw::kOldSession;
  }
  if (now - state.stamp > limits_.max_age) return StateFlaw::kLate;
  if (state.stamp - now > limits_.max_ahead) return StateFlaw::kFromFuture;
  return StateFlaw::kNone;
}

StateGate::Verdict StateGate::judge(const JointState& state, Time now) noexcept {
  const StateFlaw flaw = flaw_of(state, now);
  ++counts_[static_cast<std::size_t>(flaw)];
  if (flaw != StateFlaw::kNone) return {flaw, false};

  const bool new_session = any_ && state.session != session_;
  if (new_session) {
    previous_session_ = session_;
    has_previous_session_ = true;
  }
  any_ = true;
  session_ = state.session;
  seq_ = state.seq;
  stamp_ = state.stamp;
  return {StateFlaw::kNone, new_session};
}

const char* to_string(StateFlaw flaw) noexcept {
  switch (flaw) {
    case StateFlaw::kNone: return "good";
    case StateFlaw::kWrongJoints: return "wrong number of joints";
    case StateFlaw::kNotFinite: return "not finite";
    case StateFlaw::kOutOfRange: return "out of range";
    case StateFlaw::kOldSession: return "old session";
    case StateFlaw::kDuplicate: return "duplicate";
    case StateFlaw::kReordered: return "reordered";
    case StateFlaw::kLate: return "late";
    case StateFlaw::kFromFuture: return "from the future";
  }
  return "invalid";
}

}  // namespace breakshot::safety
