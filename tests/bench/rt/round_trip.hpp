#pragma once

#include "controller/rt/histogram.hpp"

#include <cstdint>
#include <string>

namespace breakshot::bench {

/// Round trips through DDS between two processes: from before a command is handed to the writer to when the state that acknowledges it
/// (JointState::command_seq) is handed over. Through the cell's own endpoints and through bare Fast DDS, in turns.
struct RoundTrips {
  rt::Histogram ours, bare;
  std::uint64_t lost_ours = 0, lost_bare = 0;  ///< without an answer in time; both are best effort

  double ratio(double p) const noexcept;
};

/// The two kinds of endpoints.
enum class Link { kOurs, kBare };

struct RoundTripSettings {
  int count = 20'000;  ///< of either kind
  int domain = 0;
  int priority =
      60;  ///< SCHED_FIFO of the sending thread and of DDS's threads on both sides, as the controller's; where the system grants it
};

/// Starts this program again for the other side of each link (see run_echo()) and measures, one round trip per ms, in turns of 250 (A B A B).
/// @throws std::runtime_error when the other side does not answer
RoundTrips measure_round_trips(const RoundTripSettings& settings);

/// The other side: answers every command with a state, at once, on the thread that DDS brings it on. Until the process is killed.
[[noreturn]] void run_echo(Link link, int domain, int priority);

}  // namespace breakshot::bench
