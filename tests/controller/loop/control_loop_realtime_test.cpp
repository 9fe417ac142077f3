#include "tests/controller/loop/call_counter.hpp"
#include "tests/controller/loop/harness.hpp"

#include "controller/rt/histogram.hpp"
#include "controller/rt/periodic_timer.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace breakshot::control::test {
namespace {

TEST(CallCounter, SeesTheHeapAndTheMutex) {
  if (!counting_works()) GTEST_SKIP() << "sanitizers replace the same functions";
  start_counting();
  void* volatile block = std::malloc(10);  // volatile: the optimiser drops a pair that nobody can see
  std::free(block);
  static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  pthread_mutex_lock(&mutex);
  pthread_mutex_unlock(&mutex);
  const auto counts = stop_counting();
  EXPECT_EQ(counts.heap, 2U);
  EXPECT_EQ(counts.mutexes, 2U);
}

// Ticks with strokes, refusals, both kinds of stop, lost and spoilt states, restarts and recoveries: no heap, no lock. The time of each tick, as
// CPU time of the thread, is recorded as a property of the test.
TEST(ControlLoopRealtime, TicksWithoutHeapOrLockWhateverHappens) {
  if (!counting_works()) GTEST_SKIP() << "sanitizers replace the same functions";
  constexpr int kTicks = 200'000;
  Stand stand;
  std::mt19937 random{1};
  rt::Histogram compute;
  std::unique_ptr<motion::Trajectory> trajectory;
  CallCounts total;
  int started = 0, stopped = 0, refused = 0, recovered = 0;

  for (int i = 0; i < kTicks; ++i) {
    const auto status = stand.status();
    if (status.ready() && i % 5 == 0) {
      trajectory = make_trajectory(status.setpoint.q, all(random() % 2 == 0 ? 0.3 : -0.3), static_cast<std::uint64_t>(i), 500);
      if (random() % 5 == 0) trajectory->points[250].q[1] += 0.1;
      if (random() % 5 == 0) trajectory->joints = 5;
      stand.start(*trajectory);
      ++started;
    }
    if (random() % 700 == 0) stand.request(LoopRequest::Kind::kStop);
    if (random() % 50 == 0) stand.request(LoopRequest::Kind::kRecover);
    if (random() % 10'000 == 0) stand.restart_drives();
    for (int step = random() % 5'000 == 0 ? 30 : 1; step > 0; --step) stand.drives.step();
    JointState state = stand.drives.state();
    if (random() % 100 == 0) state.q[0] = std::nan("");
    const bool lost = (i / 100) % 30 == 0 || random() % 50 == 0;

    start_counting();
    const Duration before = rt::thread_cpu_now();
    stand.last = stand.loop.tick(lost ? nullptr : &state, stand.now());
    const Duration after = rt::thread_cpu_now();
    const auto counts = stop_counting();
    compute.record(after - before);
    total.heap += counts.heap;
    total.mutexes += counts.mutexes;

    stand.drives.take(stand.last);
    for (const auto& event : stand.events()) {
      stopped += event.kind == LoopEvent::Kind::kStopped;
      refused += event.kind == LoopEvent::Kind::kNotStarted;
      recovered += event.kind == LoopEvent::Kind::kRecovered;
    }
    stand.clear();
    const motion::Trajectory* returned = nullptr;
    while (stand.channels.returns.pop(returned)) {
    }
  }

  EXPECT_EQ(total.heap, 0U);
  EXPECT_EQ(total.mutexes, 0U);
  EXPECT_GT(started, 50);
  EXPECT_GT(stopped, 50);
  EXPECT_GT(refused, 10);
  EXPECT_GT(recovered, 50);
  const auto ns = [](Duration span) { return static_cast<int>(span.count()); };
  RecordProperty("tick_cpu_p50_ns", ns(compute.quantile(0.5)));
  RecordProperty("tick_cpu_p999_ns", ns(compute.quantile(0.999)));
  RecordProperty("tick_cpu_max_ns", ns(compute.max()));
  std::printf("tick, CPU time of the thread: p50 %d ns, p99 %d ns, p99.9 %d ns, p99.99 %d ns, max %d ns\n", ns(compute.quantile(0.5)),
              ns(compute.quantile(0.99)), ns(compute.quantile(0.999)), ns(compute.quantile(0.9999)), ns(compute.max()));
}

}  // namespace
}  // namespace breakshot::control::test
