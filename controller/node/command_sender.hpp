#pragma once

#include "controller/node/loop_thread.hpp"

#include <functional>
#include <thread>

namespace breakshot::control {

/// Takes the newest command from the loop and hands it to `send`, in a thread of its own: sending may block, the loop may not.
class CommandSender {
 public:
  /// @param priority  SCHED_FIFO of the thread, where the system grants it; 0: none
  CommandSender(LoopLinks& links, int priority, std::function<void(const JointCommand&)> send);
  ~CommandSender();
  CommandSender(const CommandSender&) = delete;
  CommandSender& operator=(const CommandSender&) = delete;
  CommandSender(CommandSender&&) = delete;
  CommandSender& operator=(CommandSender&&) = delete;

 private:
  LoopLinks& links_;
  std::function<void(const JointCommand&)> send_;
  std::jthread thread_;
};

}  // namespace breakshot::control
