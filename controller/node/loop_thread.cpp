#include "controller/node/loop_thread.hpp"

#include "controller/rt/periodic_timer.hpp"

namespace breakshot::control {

namespace {

/// The figures are 20 kB: copied out ten times a second, not at every tick.
constexpr std::uint64_t kFiguresEvery = 100;
/// In lockstep mode the simulator may wait for others, 2 s of wall time for a scene for example. When it is silent for longer than that, it is gone.
constexpr Duration kLockstepSilence = std::chrono::seconds{5};
constexpr Duration kLockstepLook = std::chrono::milliseconds{100};

}  // namespace

LoopThread::LoopThread(Mode mode, ControlLoop& loop, LoopLinks& links, Duration period, const rt::RealtimeSettings& realtime)
    : loop_{loop}, links_{links}, period_{period}, realtime_{realtime} {
  thread_ = std::thread{[this, mode] { mode == Mode::kRealTime ? run_realtime() : run_lockstep(); }};
}

LoopThread::~LoopThread() { stop(); }

const LoopFigures& LoopThread::stop() {
  if (thread_.joinable()) {
    stop_.store(true, std::memory_order_relaxed);
    links_.state_came.notify();
    thread_.join();
  }
  return figures_;
}

void LoopThread::run_realtime() noexcept {
  missing_.set_value(rt::make_thread_realtime(realtime_));
  rt::PeriodicTimer timer{period_, rt::monotonic_now() + period_};
  rt::OverrunJudge judge{period_};
  judge.read(rt::thread_cpu_now());
  JointState state;
  while (!stop_.load(std::memory_order_relaxed)) {
    const rt::TimerTick tick = timer.wait();
    if (tick.error != 0) {
      links_.timer_error.store(tick.error);
      return;
    }
    const bool came = links_.states.read(state);
    send(loop_.tick(came ? &state : nullptr, tick.due));
    judge.skipped(tick.skipped);
    figures_.overruns = judge.overruns();
    figures_.wakeup.record(tick.lateness(period_));
    const Duration compute = rt::monotonic_now() - tick.woke;
    if (judge.is_late(compute)) {
      judge.late_tick(compute, rt::thread_cpu_now());
    } else {
      judge.tick_in_time(compute);
      if (figures_.cycles % kFiguresEvery == 0) judge.read(rt::thread_cpu_now());
    }
    record(compute);
  }
}

void LoopThread::run_lockstep() noexcept {
  missing_.set_value({});
  JointState state;
  JointState last;
  JointCommand answer;
  Time last_came = rt::monotonic_now();
  while (!stop_.load(std::memory_order_relaxed)) {
    links_.state_came.wait(kLockstepLook);
    links_.heartbeats.fetch_add(1, std::memory_order_relaxed);
    const Time woke = rt::monotonic_now();
    if (links_.states.read(state)) {
      last_came = woke;
      const bool again = answer.q.size() > 0 && state.session == last.session && state.seq == last.seq;
      if (!again) {
        answer = loop_.tick(&state, state.stamp);
        // The world waits for this very number, also when the loop made nothing of the state.
        answer.state_seq = state.seq;
        last = state;
      }
      send(answer);
      record(rt::monotonic_now() - woke);
    } else if (woke - last_came > kLockstepSilence && last.q.size() > 0) {
      // The drives are gone and time stands still: let the loop see it, as it would in real time.
      last.stamp += period_;
      loop_.tick(nullptr, last.stamp);
    }
  }
}

void LoopThread::send(const JointCommand& command) noexcept {
  if (command.q.size() == 0) return;
  links_.commands.write(command);
  links_.command_ready.notify();
}

void LoopThread::record(Duration compute) noexcept {
  ++figures_.cycles;
  figures_.compute.record(compute);
  links_.heartbeats.fetch_add(1, std::memory_order_relaxed);
  if (figures_.cycles % kFiguresEvery == 0) links_.figures.write(figures_);
}

}  // namespace breakshot::control
