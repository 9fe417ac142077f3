#pragma once

#include "common/time.hpp"
#include "planner/planner_config.hpp"
#include "planner/strategy/strategy.hpp"
#include "planner/task/task_runner.hpp"

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>

namespace breakshot::planner {

/// A decision, on its way back to the task.
struct Decided {
  std::uint64_t ticket = 0;
  strategy::Decision decision;
  Duration think{};  ///< of wall time
};

/// Runs the strategy in a thread of its own, so that status keeps flowing and a cancel is heard while it thinks.
class Thinker {
 public:
  /// @param filter  optional; used on the thinker's thread only, and must outlive it
  /// @param done    called on that thread with every decision
  Thinker(std::unique_ptr<strategy::Strategy> strategy, strategy::StrokeFilter* filter, std::function<void(Decided)> done);

  /// Begins with this question at once: one that still waits is dropped, the one at hand is told to end, as nobody waits for their answers any more.
  void ask(task::RunStrategy question);

 private:
  void run(const std::stop_token& stop);

  std::unique_ptr<strategy::Strategy> strategy_;
  strategy::StrokeFilter* filter_;
  std::function<void(Decided)> done_;
  std::mutex mutex_;
  std::condition_variable_any asked_;
  std::optional<task::RunStrategy> question_;
  std::stop_source at_hand_;  // stops the question at hand
  std::jthread thread_;       // last: it uses all of the above
};

}  // namespace breakshot::planner
