#include "sim_bridge/node/scene_watch.hpp"

#include <algorithm>

namespace breakshot::sim_bridge {

void SceneWatch::saw(std::uint64_t frame_seq) {
  {
    const std::lock_guard lock{mutex_};
    newest_ = std::max(newest_, frame_seq);
    present_ = true;
  }
  came_.notify_all();
}

SceneWatch::Outcome SceneWatch::wait_for(std::uint64_t frame_seq, Duration timeout) {
  std::unique_lock lock{mutex_};
  if (!present_) return Outcome::kNobody;
  if (came_.wait_for(lock, timeout, [&] { return closed_ || newest_ >= frame_seq; })) return Outcome::kSeen;
  present_ = false;
  return Outcome::kTimeout;
}

void SceneWatch::close() {
  {
    const std::lock_guard lock{mutex_};
    closed_ = true;
  }
  came_.notify_all();
}

}  // namespace breakshot::sim_bridge
