#pragma once

#include "common/time.hpp"
#include "sim_bridge/node/pace.hpp"
#include "sim_bridge/world/sim_world.hpp"

#include <array>
#include <cstdint>
#include <mutex>

namespace breakshot::sim_bridge {

/// How the physics thread is doing. Written by it, read by the health reporter; a lock that is held for some loads and stores.
class PhysicsFigures {
 public:
  struct Summary {
    std::uint64_t ticks = 0;
    std::uint64_t rounds = 0;   ///< of the thread's loop, with or without ticks
    std::uint64_t slipped = 0;  ///< ticks that were let go
    std::uint64_t taken = 0;    ///< commands
    std::uint64_t refused = 0;
    bool waiting = false;  ///< lockstep: no command for the present state yet
    double rate = 0.0;     ///< ticks per second of wall time, over the last second
    double wakeup_p99_us = 0.0, wakeup_max_us = 0.0;
    double compute_p99_us = 0.0, compute_max_us = 0.0;  ///< of a round
  };

  void record(const Pace& pace, Duration late, Duration compute, const SimWorld& world) noexcept;
  /// Lockstep: went round without a tick.
  void waited() noexcept;

  /// @param now  wall time
  Summary summary(Time now);

 private:
  /// Times in bins of powers of two from 1 us: enough to see the tail at a glance.
  class Tail {
   public:
    void record(Duration span) noexcept;
    double p99_us() const noexcept;
    double max_us() const noexcept { return 1e6 * to_seconds(max_); }

   private:
    std::array<std::uint64_t, 24> bins_{};
    std::uint64_t count_ = 0;
    Duration max_{};
  };

  std::mutex mutex_;
  Summary summary_;
  Tail wakeup_, compute_;
  Time rate_since_{};
  std::uint64_t rate_ticks_ = 0;
};

}  // namespace breakshot::sim_bridge
