#pragma once

#include "tests/controller/loop/harness.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <utility>

namespace breakshot::control::test {

/// Everything that can go wrong, at random: lost, spoilt, doubled and old states, lost commands, freezes, restarts, displaced arms, bad
/// trajectories, stops, recoveries and starts at the wrong time.
class Storm {
 public:
  /// @param flight   gets what the loop records; may be null
  /// @param started  told of every trajectory before the loop gets it; may be empty
  explicit Storm(unsigned seed, FlightTap* flight = nullptr, std::function<void(std::uint64_t, const motion::Trajectory&)> started = {})
      : random_{seed}, stand_{test_config(), flight}, started_{std::move(started)} {}

  struct Tally {
    int done = 0, stopped = 0, recovered = 0, refused = 0;
    std::uint64_t commands = 0;
  };

  Tally run(int ticks, const std::function<void(const Stand&, const JointCommand& before)>& look) {
    Tally tally;
    for (int i = 0; i < ticks; ++i) {
      ask();
      const JointCommand before = stand_.last;
      stand_.tick(upset());
      if (stand_.last.q.size() > 0) ++tally.commands;
      look(stand_, before);
      for (const auto& event : stand_.events()) {
        using Kind = LoopEvent::Kind;
        tally.done += event.kind == Kind::kDone;
        tally.stopped += event.kind == Kind::kStopped;
        tally.recovered += event.kind == Kind::kRecovered;
        tally.refused += event.kind == Kind::kNotStarted;
      }
      stand_.clear();
      const motion::Trajectory* returned = nullptr;
      while (stand_.channels.returns.pop(returned)) lent_ = false;
    }
    return tally;
  }

 private:
  bool chance(unsigned one_in) { return random_() % one_in == 0; }

  void ask() {
    if (chance(900)) stand_.request(LoopRequest::Kind::kStop);
    if (chance(200)) stand_.request(LoopRequest::Kind::kRecover);
    if (chance(20'000)) stand_.request(LoopRequest::Kind::kForeignCommander);
    if (chance(60) && !lent_) {
      // Towards the middle of the range from wherever the arm is.
      auto from = stand_.status().setpoint.q;
      auto by = all(0.0);
      for (std::size_t j = 0; j < kJoints; ++j) by[j] = std::uniform_real_distribution{-0.4, 0.4}(random_)-0.1 * from[j];
      trajectory_ = make_trajectory(from, by, ++id_, 400);
      if (chance(10)) {
        const std::uint64_t bits = random_();
        trajectory_->points[random_() % 400].q[random_() % kJoints] = std::bit_cast<double>(bits);
      }
      lent_ = true;
      if (started_) started_(stand_.started + 1, *trajectory_);
      stand_.start(*trajectory_);
    }
    if (chance(30'000)) stand_.restart_drives();
    if (chance(20'000)) stand_.drives.block(static_cast<int>(random_() % kJoints));
    if (chance(2'000)) stand_.drives.unblock();
    if (chance(100'000)) stand_.drives.slip(static_cast<int>(random_() % kJoints), chance(2) ? 0.1 : -0.1);
  }

  Stand::Upset upset() {
    if (bad_spell_ > 0) --bad_spell_;
    if (chance(5'000)) bad_spell_ = static_cast<int>(random_() % 60);
    const unsigned every = bad_spell_ > 0 ? 2 : 300;
    Stand::Upset upset;
    upset.lose_state = chance(every);
    upset.lose_command = chance(every);
    if (chance(3'000)) upset.skip = static_cast<int>(random_() % 40);
    if (chance(3'000)) upset.freeze = static_cast<int>(random_() % 40);
    if (chance(every)) {
      JointState state = stand_.drives.state();
      switch (random_() % 6) {
        case 0: state.q[static_cast<int>(random_() % kJoints)] = std::bit_cast<double>(random_()); break;
        case 1: state.qd[static_cast<int>(random_() % kJoints)] = std::bit_cast<double>(random_()); break;
        case 2: state.seq -= random_() % 3; break;
        case 3: state.stamp = time_from_ns(std::bit_cast<std::int64_t>(random_())); break;
        case 4: state.q.conservativeResize(static_cast<Eigen::Index>(random_() % 8)); break;
        default: state.tau.setConstant(std::nan("")); break;
      }
      upset.instead = state;
    }
    return upset;
  }

  std::mt19937_64 random_;
  Stand stand_;
  std::function<void(std::uint64_t, const motion::Trajectory&)> started_;
  std::unique_ptr<motion::Trajectory> trajectory_;
  bool lent_ = false;
  int bad_spell_ = 0;
  std::uint64_t id_ = 0;
};

}  // namespace breakshot::control::test
