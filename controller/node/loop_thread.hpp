#pragma once

#include "controller/loop/channels.hpp"
#include "controller/loop/control_loop.hpp"
#include "controller/rt/histogram.hpp"
#include "controller/rt/overrun.hpp"
#include "controller/rt/realtime.hpp"
#include "controller/rt/triple_buffer.hpp"
#include "controller/rt/wakeup.hpp"

#include <atomic>
#include <cstdint>
#include <future>
#include <thread>
#include <vector>

namespace breakshot::control {

/// What the loop's thread knows of its own timing.
struct LoopFigures {
  std::uint64_t cycles = 0;
  rt::Overruns overruns;  ///< periods that got no tick
  rt::Histogram wakeup;   ///< from the instant slept for to when the thread ran, skipped periods included; empty in lockstep mode
  rt::Histogram compute;  ///< wall time of a tick
};

/// The lock-free links between the loop's thread and those that talk DDS.
struct LoopLinks {
  rt::TripleBuffer<JointState> states;      ///< written by whoever receives them
  rt::WakeupSignal state_came;              ///< lockstep mode waits for it
  rt::TripleBuffer<JointCommand> commands;  ///< read by the command writer
  rt::WakeupSignal command_ready;
  rt::TripleBuffer<LoopFigures> figures;     ///< read by the health reporter
  std::atomic<std::uint64_t> heartbeats{0};  ///< the thread goes round, with or without states
  std::atomic<int> timer_error{0};           ///< errno that ended the real-time loop; 0: none
};

/// Runs the control loop in a thread: at its fixed rate in real time, or answering every state in lockstep.
class LoopThread {
 public:
  enum class Mode { kRealTime, kLockstep };

  /// Starts at once. The references outlive this object.
  LoopThread(Mode mode, ControlLoop& loop, LoopLinks& links, Duration period, const rt::RealtimeSettings& realtime);
  /// Ends the thread; the drives then brake by themselves.
  ~LoopThread();
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;
  LoopThread(LoopThread&&) = delete;
  LoopThread& operator=(LoopThread&&) = delete;

  /// Ends the thread, if that was not done yet. @return its figures, which nobody changes any more
  const LoopFigures& stop();

  /// What the thread could not get of the scheduler; waits until it has asked. Empty in lockstep mode. Call once.
  std::vector<rt::MissingGuarantee> missing_guarantees() { return missing_.get_future().get(); }

 private:
  void run_realtime() noexcept;
  void run_lockstep() noexcept;
  void send(const JointCommand& command) noexcept;
  void record(Duration compute) noexcept;

  ControlLoop& loop_;
  LoopLinks& links_;
  Duration period_;
  rt::RealtimeSettings realtime_;
  LoopFigures figures_;
  std::promise<std::vector<rt::MissingGuarantee>> missing_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace breakshot::control
