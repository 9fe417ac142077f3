#pragma once

#include "tests/controller/loop/call_counter.hpp"
#include "tests/controller/loop/syscall_watch.hpp"

#include "common/time.hpp"
#include "controller/rt/histogram.hpp"
#include "controller/rt/overrun.hpp"
#include "controller/rt/periodic_timer.hpp"

#include <cstdint>

namespace breakshot::control::test {

/// Minor and major page faults of the calling thread so far.
long page_faults() noexcept;

/// What watched work did that a real-time thread must not.
struct Sins {
  CallCounts calls;
  SyscallCounts system;
  long faults = 0;

  /// What a piece of work took, with reading the clocks.
  struct Cost {
    Duration cpu;
    Duration wall;
  };

  /// Runs one piece of work under watch.
  template <typename Work>
  Cost watch(const Work& work) {
    const Time began = rt::monotonic_now();  // before the faults are counted: the first one ever maps the vDSO's data
    const long faults_before = page_faults();
    const Duration before = rt::thread_cpu_now();
    start_counting();
    begin_span();
    work();
    end_span();
    const CallCounts counts = stop_counting();
    const Duration after = rt::thread_cpu_now();
    const Time ended = rt::monotonic_now();
    faults += page_faults() - faults_before;
    calls.heap += counts.heap;
    calls.mutexes += counts.mutexes;
    system = syscall_counts();
    return {after - before, ended - began};
  }
};

/// What came of a run.
struct WatchedRun {
  Sins sins;
  bool watched_system_calls = false;
  bool watched_faults = false;  ///< memory could be locked, as the controller does it
  rt::Histogram compute;        ///< CPU time of the thread per tick
  rt::Overruns overruns;        ///< ticks that took longer than their period, by whose fault
  std::uint64_t dropped = 0;    ///< by the flight recorder's tap
  int started = 0, joined = 0, stopped = 0, refused = 0, recovered = 0, restarted = 0;
};

/// Ticks a recorded control loop through strokes, alone and one out of the other, refusals, both kinds of stop, lost and spoilt states, reconnects,
/// restarts and recoveries, and watches each tick (and nothing else).
WatchedRun run_watched(int ticks, unsigned seed);

}  // namespace breakshot::control::test
