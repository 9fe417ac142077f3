#pragma once

#include "common/time.hpp"

#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace breakshot::sim_bridge {

/// Knows from which frame the newest scene was made. In lockstep mode the world waits for it, so that perception keeps up however slow the machine is.
class SceneWatch {
 public:
  /// From a DDS thread, for every scene.
  void saw(std::uint64_t frame_seq);

  enum class Outcome { kSeen, kNobody, kTimeout };
  /// Waits until the scene of frame `frame_seq`, or a later one, has come. Returns at once with kNobody while perception is known to be absent: no
  /// scene has ever come, or the last wait timed out and none came since.
  Outcome wait_for(std::uint64_t frame_seq, Duration timeout);

  /// Ends a wait (for shutdown); later ones return at once.
  void close();

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::uint64_t newest_ = 0;
  bool present_ = false;
  bool closed_ = false;
};

}  // namespace breakshot::sim_bridge
