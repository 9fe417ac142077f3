#pragma once

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "sim_bridge/node/cell_world.hpp"
#include "sim_bridge/node/mailbox.hpp"

#include <optional>
#include <thread>

namespace breakshot::sim_bridge {

/// Makes a world's order of a control request: reads the formation that it names, checks what can be checked without the world.
/// @return the order, or what is wrong with the request
Result<WorldOrder, std::string> prepare(const SimControl& request, const SimBridgeConfig& config, const CellConfig& cell);

/// Takes requests from `sim/control` in a thread of its own, because reading a formation takes time, and leaves orders for the physics thread.
///
/// Whoever asks repeats the request until `sim/truth` shows its number; repetitions that are already on their way are not carried out twice.
class ControlDesk {
 public:
  ControlDesk(dds::Participant& participant, const SimBridgeConfig& config, const CellConfig& cell, Mailbox<WorldOrder>& orders);
  ~ControlDesk();
  ControlDesk(const ControlDesk&) = delete;
  ControlDesk& operator=(const ControlDesk&) = delete;
  ControlDesk(ControlDesk&&) = delete;
  ControlDesk& operator=(ControlDesk&&) = delete;

 private:
  void run(const std::stop_token& stop);

  const SimBridgeConfig& config_;
  const CellConfig& cell_;
  Mailbox<WorldOrder>& orders_;
  dds::Reader<SimControl> reader_;
  std::jthread thread_;
};

}  // namespace breakshot::sim_bridge
