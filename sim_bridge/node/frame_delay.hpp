#pragma once

#include "common/random.hpp"
#include "common/time.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace breakshot::sim_bridge {

/// When frames come out of the camera: a latency after their exposure, more or less, drawn evenly for each; never before an earlier one.
class FrameDelay {
 public:
  FrameDelay(Duration latency, Duration jitter, std::uint64_t seed) : latency_{latency}, jitter_{jitter}, random_{seed} {}

  /// Of the next frame, exposed at a time. @param extra  on top of what the camera takes
  Time due(Time exposed, Duration extra = {}) {
    const Duration jitter = from_seconds(to_seconds(jitter_) * random_.uniform(-1.0, 1.0));
    last_ = std::max(exposed + std::max(latency_ + jitter, Duration::zero()) + extra, last_ + kApart);
    return last_;
  }

 private:
  static constexpr Duration kApart = std::chrono::milliseconds{1};

  Duration latency_, jitter_;
  SplitMix64 random_;
  Time last_{};
};

}  // namespace breakshot::sim_bridge
