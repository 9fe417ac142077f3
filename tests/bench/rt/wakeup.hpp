#pragma once

#include "controller/node/loop_thread.hpp"
#include "controller/rt/histogram.hpp"
#include "tests/bench/rt/cyclictest.hpp"

#include <cstdint>

namespace breakshot::bench {

/// Wake-up latencies of the control loop and of cyclictest, measured in turns.
struct WakeupComparison {
  rt::Histogram loop;
  LatencyCounts yardstick;
  rt::Histogram compute;    ///< wall time of the loop's ticks
  rt::Overruns overruns;    ///< of the loop
  int turns_not_ready = 0;  ///< in which the loop stood in a stop at the end: the machine held it, or the drives' thread, up for too long
  double load = 0.0;        ///< of the machine, over the last minute, when it began

  double ratio(double p) const noexcept;
};

/// @throws std::runtime_error when the system does not grant SCHED_FIFO or lacks cyclictest, with what to do
void require_realtime(const LatencySettings& settings);

/// Runs the loop and cyclictest one after the other, `span` each in all, in turns of a few seconds (A B A B): the same priority, the same core,
/// memory locked on both sides.
///
/// The loop is the controller's own: LoopThread with a ControlLoop that commands drives at rest, fed with a state per ms by a thread of its own and
/// relieved of its commands by a CommandSender, both at `io_priority`, as the controller's neighbours of the loop are. Not there: DDS, strokes, the
/// flight recorder.
WakeupComparison compare_wakeups(const LatencySettings& settings, int io_priority, Duration span);

}  // namespace breakshot::bench
