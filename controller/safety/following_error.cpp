#include "controller/safety/following_error.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::safety {

void FollowingMonitor::sent(Time due, const Setpoint& setpoint) noexcept {
  entries_[next_] = {due, setpoint.q, setpoint.qd};
  next_ = (next_ + 1) % kHistory;
  count_ = std::min(count_ + 1, kHistory);
}

std::size_t FollowingMonitor::last_due_by(Time at) const noexcept {
  // The loop ends at once in normal running, where the command lies a few back.
  std::size_t back = 0;
  while (back < count_ && newest(back).due > at) ++back;
  return back;
}

FollowingError FollowingMonitor::check(const JointState& state, Duration lag) const noexcept {
  const Time at = state.stamp - lag;
  const std::size_t back = last_due_by(at);
  if (back == count_) return {};

  const Entry& before = newest(back);
  const double since = to_seconds(at - before.due);
  FollowingError worst;
  double worst_ratio = 1.0;
  for (int i = 0; i < joints_; ++i) {
    const auto j = static_cast<std::size_t>(i);
    double q = before.q[j] + before.qd[j] * since;
    double speed = std::abs(before.qd[j]);
    if (back > 0) {
      const Entry& after = newest(back - 1);
      q = before.q[j] + (after.q[j] - before.q[j]) * since / to_seconds(after.due - before.due);
      speed = std::max(speed, std::abs(after.qd[j]));
    }
    const double limit = limits_.floor + limits_.per_speed * speed;
    const double error = state.q[i] - q;
    if (std::abs(error) > worst_ratio * limit) {
      worst = {i, error, limit};
      worst_ratio = std::abs(error) / limit;
    }
  }
  return worst;
}

std::optional<Setpoint> FollowingMonitor::commanded(Time at) const noexcept {
  const std::size_t back = last_due_by(at);
  if (back == count_) return std::nullopt;
  const Entry& before = newest(back);
  const double since = to_seconds(at - before.due);
  Setpoint setpoint{before.q, before.qd, {}};
  const Entry* after = back > 0 ? &newest(back - 1) : nullptr;
  const double share = after != nullptr ? since / to_seconds(after->due - before.due) : 0.0;
  for (std::size_t j = 0; j < setpoint.q.size(); ++j) {
    if (after != nullptr) {
      setpoint.q[j] += share * (after->q[j] - before.q[j]);
      setpoint.qd[j] += share * (after->qd[j] - before.qd[j]);
    } else {
      setpoint.q[j] += before.qd[j] * since;
    }
  }
  return setpoint;
}

}  // namespace breakshot::safety
