#pragma once

#include "controller/loop/stroke_executor.hpp"

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace breakshot::control {

/// The planning thread: owns the executor's time, takes requests from any thread and hands every status to `send`.
class StrokeDesk {
 public:
  /// @param send  called from two threads, one at a time
  /// @param now   the cell's clock
  StrokeDesk(StrokeExecutor& executor, std::function<void(const StrokeStatus&)> send, std::function<Time()> now);
  ~StrokeDesk();
  StrokeDesk(const StrokeDesk&) = delete;
  StrokeDesk& operator=(const StrokeDesk&) = delete;
  StrokeDesk(StrokeDesk&&) = delete;
  StrokeDesk& operator=(StrokeDesk&&) = delete;

  /// Queues a request. Any thread; never waits for planning.
  void submit(const StrokeRequest& request);
  /// Commands of another controller were seen. Any thread.
  void report_foreign_commander();
  /// The process ends: stops what moves on its path, refuses whatever comes.
  void close();

  /// How the loop stands, at most some milliseconds old. Any thread.
  LoopStatus loop() const;

 private:
  void run(const std::stop_token& stop);
  void repeat(const std::stop_token& stop);

  StrokeExecutor& executor_;
  std::function<void(const StrokeStatus&)> send_;
  std::function<Time()> now_;

  mutable std::mutex mutex_;
  std::condition_variable_any work_;
  std::vector<StrokeRequest> requests_;
  bool foreign_ = false;
  bool closing_ = false;
  LoopStatus loop_;
  std::optional<StrokeStatus> newest_;
  std::optional<StrokeStatus> following_;
  std::mutex sending_;  ///< keeps a repetition from overtaking the status that follows it

  std::jthread planning_;
  std::jthread repeating_;
};

}  // namespace breakshot::control
