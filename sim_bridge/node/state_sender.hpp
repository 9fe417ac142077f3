#pragma once

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "sim_bridge/node/mailbox.hpp"

#include <thread>

namespace breakshot::sim_bridge {

/// Publishes joint states and truths for the physics thread. Sending may block, that thread may not: in real-time mode a thread of the sender's own does it. In
/// lockstep mode the physics thread sends itself, which saves a hand-over per tick.
class StateSender {
 public:
  /// @param directly  send from the calling thread: lockstep mode
  /// @param priority  SCHED_FIFO of the sending thread, where the system grants it
  StateSender(dds::Participant& participant, bool directly, int priority);
  ~StateSender();
  StateSender(const StateSender&) = delete;
  StateSender& operator=(const StateSender&) = delete;
  StateSender(StateSender&&) = delete;
  StateSender& operator=(StateSender&&) = delete;

  void send(const JointState& state);
  void send(const SimTruth& truth);

 private:
  void run(const std::stop_token& stop, int priority);

  const bool directly_;
  dds::Writer<JointState> states_;
  dds::Writer<SimTruth> truths_;
  Mailbox<JointState> waiting_states_{64};
  Mailbox<SimTruth> waiting_truths_{4};
  std::jthread thread_;
};

}  // namespace breakshot::sim_bridge
