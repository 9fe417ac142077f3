#include "perception/joint_history.hpp"

#include <algorithm>

namespace breakshot::perception {
namespace {

constexpr Duration kAhead = std::chrono::milliseconds{10};  // past the newest state: at 20 rad/s^2 joints are then off by 1 mrad
// Between two states. A busy machine loses some; over so long a jerk of 600 rad/s^3 bends a joint's way from its cubic by 1 mrad.
constexpr Duration kHole = std::chrono::milliseconds{50};

}  // namespace

void JointHistory::add(const JointState& state) {
  const std::lock_guard lock{mutex_};
  if (count_ > 0 && (state.session != session_ || state.stamp <= back(0).stamp || state.q.size() != back(0).q.size())) count_ = 0;
  session_ = state.session;
  entries_[count_++ % kStates] = {state.stamp, state.q, state.qd};
}

std::optional<JointVector> JointHistory::at(Time when) const {
  const std::lock_guard lock{mutex_};
  const std::size_t kept = std::min(count_, kStates);
  if (kept == 0 || when > back(0).stamp + kAhead) return std::nullopt;
  if (when >= back(0).stamp) return JointVector{back(0).q + to_seconds(when - back(0).stamp) * back(0).qd};
  // The first state that is not after `when`, newest first.
  std::size_t low = 0, high = kept - 1;
  if (when < back(high).stamp) return std::nullopt;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (back(middle).stamp <= when) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  const Entry& before = back(low);
  const Entry& after = back(low - 1);
  if (after.stamp - before.stamp > kHole) return std::nullopt;
  // The cubic that has both angles and both speeds (Hermite).
  const double length = to_seconds(after.stamp - before.stamp);
  const double s = to_seconds(when - before.stamp) / length;
  const double r = 1.0 - s;
  return JointVector{before.q * (r * r * (1.0 + 2.0 * s)) + before.qd * (r * r * s * length) + after.q * (s * s * (1.0 + 2.0 * r)) -
                     after.qd * (s * s * r * length)};
}

}  // namespace breakshot::perception
