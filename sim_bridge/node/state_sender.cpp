#include "sim_bridge/node/state_sender.hpp"

namespace breakshot::sim_bridge {

StateSender::StateSender(dds::Participant& participant, bool directly) : directly_{directly}, states_{participant}, truths_{participant} {
  if (!directly_) thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
}

StateSender::~StateSender() {
  thread_.request_stop();
  waiting_states_.wake();
}

void StateSender::send(const JointState& state) { directly_ ? static_cast<void>(states_.write(state)) : waiting_states_.put(state); }

void StateSender::send(const SimTruth& truth) { directly_ ? static_cast<void>(truths_.write(truth)) : waiting_truths_.put(truth); }

void StateSender::run(const std::stop_token& stop) {
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
