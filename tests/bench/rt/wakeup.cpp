#include "tests/bench/rt/wakeup.hpp"

#include "common/process/scheduling.hpp"
#include "controller/node/command_sender.hpp"
#include "controller/rt/periodic_timer.hpp"
#include "controller/rt/realtime.hpp"
#include "tests/bench/rt/child_program.hpp"
#include "tests/controller/loop/harness.hpp"

#include <fmt/core.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <thread>

namespace breakshot::bench {

namespace {

namespace stand = control::test;

/// Long against the start of a process, short against what else the machine takes up and leaves off meanwhile.
constexpr Duration kTurn = std::chrono::seconds{2};

rt::RealtimeSettings realtime_of(const LatencySettings& settings) {
  rt::RealtimeSettings realtime;
  realtime.priority = settings.priority;
  realtime.cpu = settings.cpu;
  realtime.wake_latency_us = settings.wake_latency_us;
  return realtime;
}

/// Drives at the loop's side of DDS: they take its commands and bring a state per ms.
class Drives {
 public:
  Drives(control::LoopLinks& links, int priority)
      : thread_{[this, &links, priority](const std::stop_token& stop) {
          const process::InheritedFifo fifo{priority};
          rt::PeriodicTimer timer{stand::kTick, rt::monotonic_now()};
          while (!stop.stop_requested()) {
            const auto tick = timer.wait();
            const std::lock_guard lock{mutex_};
            drives_.step_to(tick.due);
            links.states.write(drives_.state());
          }
        }} {}

  void take(const JointCommand& command) {
    const std::lock_guard lock{mutex_};
    drives_.take(command);
  }

 private:
  std::mutex mutex_;
  stand::FakeDrives drives_{7};
  std::jthread thread_;
};

/// The loop for a while; its figures are added to `comparison`.
void run_loop(const LatencySettings& settings, int io_priority, Duration span, WakeupComparison& comparison) {
  control::LoopConfig config = stand::test_config();
  config.period = settings.period;
  control::LoopChannels channels;
  control::LoopLinks links;
  control::ControlLoop loop{config, channels};
  Drives drives{links, io_priority};
  const control::CommandSender sender{links, io_priority, [&drives](const JointCommand& command) { drives.take(command); }};
  const rt::WakeLatencyLimit no_sleep{realtime_of(settings).wake_latency_us};
  control::LoopThread thread{control::LoopThread::Mode::kRealTime, loop, links, config.period, realtime_of(settings)};
  if (const auto missing = thread.missing_guarantees(); !missing.empty()) throw std::runtime_error(missing.front().what);
  {
    // Else this thread oversleeps just when the machine is busy, and the loop is measured longer in its worst moments than cyclictest, which counts its cycles.
    const process::InheritedFifo awake{io_priority};
    std::this_thread::sleep_for(span);
    thread.stop();
  }
  const control::LoopFigures& figures = thread.stop();
  if (const int error = links.timer_error; error != 0) throw std::runtime_error(fmt::format("clock_nanosleep: {}", std::strerror(error)));
  if (!channels.status.latest().ready()) ++comparison.turns_not_ready;
  comparison.loop.merge(figures.wakeup);
  comparison.compute.merge(figures.compute);
  comparison.overruns.ours += figures.overruns.ours;
  comparison.overruns.hosts += figures.overruns.hosts;
}

}  // namespace

double WakeupComparison::ratio(double p) const noexcept { return 1e6 * to_seconds(loop.quantile(p)) / yardstick.quantile_us(p); }

void require_realtime(const LatencySettings& settings) {
  std::vector<rt::MissingGuarantee> missing;
  std::thread{[&] { missing = rt::make_thread_realtime(realtime_of(settings)); }}.join();
  if (!missing.empty()) {
    throw std::runtime_error(
        fmt::format("the wake-up cannot be compared without real-time scheduling: {}. To grant it: {}. Or leave this part out: --no-wakeup",
                    missing.front().what, missing.front().remedy));
  }
  find_program("cyclictest", "rt-tests");
}

WakeupComparison compare_wakeups(const LatencySettings& settings, int io_priority, Duration span) {
  WakeupComparison comparison;
  getloadavg(&comparison.load, 1);
  if (const auto missing = rt::lock_memory(realtime_of(settings)); !missing.empty())
    throw std::runtime_error(missing.front().what + ". To grant it: " + missing.front().remedy);
  for (Duration left = span; left > Duration::zero(); left -= kTurn) {
    const Duration turn = std::min(kTurn, left);
    run_loop(settings, io_priority, turn, comparison);
    comparison.yardstick.merge(run_cyclictest(settings, turn));
  }
  munlockall();
  return comparison;
}

}  // namespace breakshot::bench
