#include "controller/node/command_sender.hpp"

#include "common/process/scheduling.hpp"

#include <optional>
#include <utility>

namespace breakshot::control {

CommandSender::CommandSender(LoopLinks& links, int priority, std::function<void(const JointCommand&)> send)
    : links_{links}, send_{std::move(send)} {
  thread_ = std::jthread{[this, priority](const std::stop_token& stop) {
    std::optional<process::InheritedFifo> fifo;
    if (priority > 0) fifo.emplace(priority);
    JointCommand command;
    while (!stop.stop_requested()) {
      links_.command_ready.wait(std::chrono::milliseconds{100});
      if (links_.commands.read(command)) send_(command);
    }
  }};
}

CommandSender::~CommandSender() {
  thread_.request_stop();
  links_.command_ready.notify();
}

}  // namespace breakshot::control
