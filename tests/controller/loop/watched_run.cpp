#include "tests/controller/loop/watched_run.hpp"

#include "tests/controller/loop/harness.hpp"

#include "controller/rt/realtime.hpp"

#include <sys/mman.h>
#include <sys/resource.h>

#include <cmath>
#include <memory>
#include <random>

namespace breakshot::control::test {

long page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

WatchedRun run_watched(int ticks, unsigned seed) {
  const auto tap = std::make_unique<FlightTap>();
  const auto stand_memory = std::make_unique<Stand>(test_config(), tap.get());
  Stand& stand = *stand_memory;
  std::mt19937 random{seed};
  WatchedRun run;
  run.watched_faults = rt::lock_memory({}).empty();
  run.watched_system_calls = watch_syscalls();
  std::unique_ptr<motion::Trajectory> trajectory;
  std::unique_ptr<motion::Trajectory> next;

  for (int i = 0; i < ticks; ++i) {
    const auto status = stand.status();
    if (status.ready() && i % 5 == 0) {
      trajectory = make_trajectory(status.setpoint.q, all(random() % 2 == 0 ? 0.3 : -0.3), static_cast<std::uint64_t>(i), 500);
      if (random() % 5 == 0) trajectory->points[250].q[1] += 0.1;
      if (random() % 5 == 0) trajectory->joints = 5;
      stand.start(*trajectory);
      ++run.started;
    }
    if (status.joinable == stand.started && status.joinable != 0 && status.cursor == 50 && !next) {
      next = make_joined(*trajectory, 300, all(0.2), static_cast<std::uint64_t>(i));
      stand.join(*next, {status.joinable, 300});
    }
    if (random() % 700 == 0) stand.request(LoopRequest::Kind::kStop);
    if (random() % 50 == 0) stand.request(LoopRequest::Kind::kRecover);
    if (random() % 10'000 == 0) {
      stand.restart_drives();
      ++run.restarted;
    }
    for (int step = random() % 5'000 == 0 ? 30 : 1; step > 0; --step) stand.drives.step();
    JointState state = stand.drives.state();
    if (random() % 100 == 0) state.q[0] = std::nan("");
    const bool lost = (i / 100) % 30 == 0 || random() % 50 == 0;

    const Sins::Cost cost = run.sins.watch([&] { stand.last = stand.loop.tick(lost ? nullptr : &state, stand.now()); });
    run.compute.record(cost.cpu);
    if (cost.wall >= kTick) ++(rt::overran_by_computing(cost.wall, cost.cpu) ? run.overruns.ours : run.overruns.hosts);

    stand.drives.take(stand.last);
    for (const auto& event : stand.events()) {
      run.joined += event.joined;
      run.stopped += event.kind == LoopEvent::Kind::kStopped;
      run.refused += event.kind == LoopEvent::Kind::kNotStarted;
      run.recovered += event.kind == LoopEvent::Kind::kRecovered;
    }
    stand.clear();
    const motion::Trajectory* returned = nullptr;
    while (stand.channels.returns.pop(returned)) {
      if (returned == next.get()) next.reset();
    }
    TickRecord record;
    while (tap->ticks.pop(record)) {
    }
    Keyframe keyframe;
    while (tap->keyframes.pop(keyframe)) {
    }
  }
  munlockall();
  run.dropped = tap->ticks.dropped() + tap->keyframes.dropped();
  return run;
}

}  // namespace breakshot::control::test
