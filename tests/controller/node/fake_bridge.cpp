#include "tests/controller/node/fake_bridge.hpp"

#include "controller/rt/periodic_timer.hpp"

namespace breakshot::control::test {

FakeBridge::FakeBridge(dds::Participant& participant, bool lockstep, const FakeDrives& drives)
    : lockstep_{lockstep}, drives_{drives}, writer_{participant}, commands_{participant, [this](JointCommand&& command) {
                                                                              const std::lock_guard lock{mutex_};
                                                                              drives_.take(command);
                                                                              answered_seq_ = command.state_seq;
                                                                              answered_.notify_all();
                                                                            }} {
  thread_ = std::jthread{[this](const std::stop_token& stop) { lockstep_ ? run_lockstep(stop) : run(stop); }};
}

FakeBridge::~FakeBridge() = default;

FakeDrives FakeBridge::drives() {
  const std::lock_guard lock{mutex_};
  return drives_;
}

void FakeBridge::run(const std::stop_token& stop) {
  rt::PeriodicTimer timer{kTick, rt::monotonic_now()};
  while (!stop.stop_requested()) {
    const auto tick = timer.wait();
    JointState state;
    {
      const std::lock_guard lock{mutex_};
      // The drives catch up, as a simulator that wakes late does.
      drives_.step_to(tick.due);
      state = drives_.state();
    }
    writer_.write(state);
  }
}

void FakeBridge::run_lockstep(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::unique_lock lock{mutex_};
    drives_.step();
    const JointState state = drives_.state();
    while (!stop.stop_requested()) {
      lock.unlock();
      writer_.write(state);
      lock.lock();
      if (answered_.wait_for(lock, stop, std::chrono::milliseconds{20}, [&] { return answered_seq_ == state.seq; })) break;
      ++repeated_;
    }
  }
}

}  // namespace breakshot::control::test
