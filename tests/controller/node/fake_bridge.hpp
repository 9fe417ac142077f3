#pragma once

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "tests/controller/loop/harness.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace breakshot::control::test {

/// Drives at the other end of cell/joint_state and cell/joint_command, in lockstep or at wall speed.
class FakeBridge {
 public:
  /// @param drives  where the arm is and of which session; a bridge that restarts is another object with the same arm
  FakeBridge(dds::Participant& participant, bool lockstep, const FakeDrives& drives);
  /// The drives fall silent. Their arm stays in drives().
  ~FakeBridge();
  FakeBridge(const FakeBridge&) = delete;
  FakeBridge& operator=(const FakeBridge&) = delete;
  FakeBridge(FakeBridge&&) = delete;
  FakeBridge& operator=(FakeBridge&&) = delete;

  FakeDrives drives();
  /// States that were sent more than once because no answer came in time.
  std::uint64_t repeated() const noexcept { return repeated_; }

 private:
  void run(const std::stop_token& stop);
  void run_lockstep(const std::stop_token& stop);

  bool lockstep_;
  std::mutex mutex_;
  std::condition_variable_any answered_;
  FakeDrives drives_;
  std::uint64_t answered_seq_ = 0;
  std::atomic<std::uint64_t> repeated_{0};
  dds::Writer<JointState> writer_;
  dds::Subscription<JointCommand> commands_;
  std::jthread thread_;
};

}  // namespace breakshot::control::test
