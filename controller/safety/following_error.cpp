#include "controller/safety/following_error.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::safety {

void FollowingMonitor::sent(Time due, const Setpoint& setpoint) noexcept {
  entries_[next_] = {due, setpoint.q, setpoint.qd};
  next_ = (next_ + 1) % kHistory;
  count_ = std::min(count_ + 1, kHistory);
}

FollowingError FollowingMonitor::check(const JointState& state, Duration lag) const noexcept {
  const Time at = state.stamp - lag;
  // The newest command that was due at the instant; the loop ends at once in normal running, where it lies a few commands back.
  std::size_t back = 0;
  while (back < count_ && newest(back).due > at) ++back;
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

}  // namespace breakshot::safety
