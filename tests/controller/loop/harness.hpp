#pragma once

#include "controller/loop/channels.hpp"
#include "controller/loop/control_loop.hpp"
#include "controller/motion/trajectory.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <vector>

// What the loop's tests share: drives that keep the contract of common/joints.hpp to the letter, trajectories, and a stand that ticks both.

namespace breakshot::control::test {

inline constexpr int kJoints = 6;
inline constexpr Duration kTick = std::chrono::milliseconds{1};

LoopConfig test_config();

/// Ideal drives: they are where the commands say, at the instant they say, and brake by themselves after 20 ms without one.
class FakeDrives {
 public:
  explicit FakeDrives(std::uint64_t session);

  void step();
  /// Steps until the drives' clock, which is set to `now` when it is far behind, has reached it.
  void step_to(Time now);
  /// The drives start anew where the arm stands.
  void restart();
  void take(const JointCommand& command);
  JointState state() const;

  /// Where the arm stands at the start.
  void place(const JointVector& q) { q_ = q; }
  /// Something holds a joint where it now is, whatever the commands say; or lets go.
  void block(int joint) {
    blocked_joint_ = joint;
    blocked_at_ = q_[joint];
  }
  void unblock() { blocked_joint_ = -1; }
  /// An encoder loses count: from now on the joint is measured off, by up to `by` at 2 rad/s.
  void slip(int joint, double by) {
    slipping_joint_ = joint;
    slip_left_ = by;
  }

 private:
  void move();

  std::uint64_t session_;
  std::uint64_t seq_ = 0;
  std::uint64_t command_seq_ = 0;
  std::uint64_t commander_ = 0;
  Time now_{std::chrono::seconds{100}};
  int ticks_without_command_ = 1000;
  std::vector<JointCommand> commands_;  ///< newest last
  JointVector q_, qd_, offset_;
  int blocked_joint_ = -1;
  double blocked_at_ = 0.0;
  int slipping_joint_ = 0;
  double slip_left_ = 0.0;

  friend class Stand;
};

/// A rest-to-rest motion over every joint, with the phases of a hit and its contact in the middle of the run-in's straight.
/// @param from  set-point to begin at; it moves every joint by `by`, within the limits of test_config()
std::unique_ptr<motion::Trajectory> make_trajectory(const safety::JointArray& from, const safety::JointArray& by, std::uint64_t id,
                                                    std::size_t ticks = 800);
safety::JointArray all(double value);
/// Takes over from `first` at `tick`: goes on as it does to its end, and from there by `by`.
std::unique_ptr<motion::Trajectory> make_joined(const motion::Trajectory& first, std::size_t tick, const safety::JointArray& by,
                                                std::uint64_t id);

/// Loop and drives, tick by tick, with hands on everything between them.
class Stand {
 public:
  explicit Stand(const LoopConfig& config = test_config(), FlightTap* flight = nullptr);

  /// What may go wrong in a tick.
  struct Upset {
    bool lose_state = false;
    bool lose_command = false;
    std::optional<JointState> instead{};  ///< comes in the place of the true state
    int skip = 0;                         ///< periods that the loop sleeps through (the drives go on)
    int freeze = 0;                       ///< periods for which both stand still, and the drives catch up before the loop wakes
  };
  JointCommand tick(const Upset& upset);
  JointCommand tick() { return tick(Upset{}); }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) tick();
  }
  /// Ticks until the loop is ready for a stroke; fails after 100.
  bool get_ready();
  /// Ticks until `kind` is among the events; fails after `limit`.
  bool run_until(LoopEvent::Kind kind, int limit = 3000);

  void request(LoopRequest::Kind kind) { channels.requests.push({.kind = kind}); }
  void start(const motion::Trajectory& trajectory) {
    channels.requests.push({.kind = LoopRequest::Kind::kStart, .trajectory = &trajectory, .trajectory_number = ++started});
  }
  /// Asks that a trajectory takes over from another one.
  void join(const motion::Trajectory& trajectory, LoopRequest::Join at) {
    channels.requests.push({.kind = LoopRequest::Kind::kStart, .trajectory = &trajectory, .trajectory_number = ++started, .join = at});
  }
  LoopStatus status() { return channels.status.latest(); }
  /// Events since the last call of clear(), oldest first.
  const std::vector<LoopEvent>& events();
  const LoopEvent* find(LoopEvent::Kind kind);
  void clear() {
    events();
    events_.clear();
  }
  void restart_drives() { drives.restart(); }

  LoopConfig config;
  LoopChannels channels;
  ControlLoop loop;
  FakeDrives drives;
  JointCommand last;          ///< command of the last tick
  std::uint64_t started = 0;  ///< trajectories handed over so far
  Time now() const { return drives.now_; }

 private:
  std::vector<LoopEvent> events_;
};

}  // namespace breakshot::control::test
