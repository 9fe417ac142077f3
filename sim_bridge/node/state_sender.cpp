#include "sim_bridge/node/state_sender.hpp"

#include <pthread.h>

namespace breakshot::sim_bridge {

StateSender::StateSender(dds::Participant& participant, bool directly, int priority)
    : directly_{directly}, states_{participant}, truths_{participant} {
  if (!directly_) thread_ = std::jthread{[this, priority](const std::stop_token& stop) { run(stop, priority); }};
}

StateSender::~StateSender() {
  thread_.request_stop();
  waiting_states_.wake();
}

void StateSender::send(const JointState& state) { directly_ ? static_cast<void>(states_.write(state)) : waiting_states_.put(state); }

void StateSender::send(const SimTruth& truth) { directly_ ? static_cast<void>(truths_.write(truth)) : waiting_truths_.put(truth); }

void StateSender::run(const std::stop_token& stop, int priority) {
  pthread_setname_np(pthread_self(), "states");
  // A state that leaves late is a late state. Without the right to it the physics thread has warned already.
  sched_param parameters{};
  parameters.sched_priority = priority;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  std::vector<JointState> states;
  std::vector<SimTruth> truths;
  while (!stop.stop_requested()) {
    waiting_states_.wait_all(states, std::chrono::milliseconds{10});
    for (const JointState& state : states) states_.write(state);
    waiting_truths_.take_all(truths);
    for (const SimTruth& truth : truths) truths_.write(truth);
  }
}

}  // namespace breakshot::sim_bridge
