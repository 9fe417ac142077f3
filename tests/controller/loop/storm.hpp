#pragma once

#include "tests/controller/loop/harness.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <utility>
#include <vector>

namespace breakshot::control::test {

/// Everything that can go wrong, at random: lost, spoilt, doubled and old states, lost commands, freezes, restarts, displaced arms, bad
/// trajectories, stops, recoveries, starts at the wrong time, and trajectories that take over from one another, or are asked to where they cannot.
class Storm {
 public:
  /// @param flight   gets what the loop records; may be null
  /// @param started  told of every trajectory before the loop gets it; may be empty
  explicit Storm(unsigned seed, FlightTap* flight = nullptr, std::function<void(std::uint64_t, const motion::Trajectory&)> started = {})
      : random_{seed}, stand_{test_config(), flight}, started_{std::move(started)} {}

  struct Tally {
    int done = 0, joined = 0, stopped = 0, recovered = 0, refused = 0;
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
        tally.joined += event.joined;
        tally.stopped += event.kind == Kind::kStopped;
        tally.recovered += event.kind == Kind::kRecovered;
        tally.refused += event.kind == Kind::kNotStarted;
      }
      stand_.clear();
      const motion::Trajectory* returned = nullptr;
      while (stand_.channels.returns.pop(returned))
        std::erase_if(lent_, [&](const Lent& each) { return each.trajectory.get() == returned; });
    }
    return tally;
  }

 private:
  bool chance(unsigned one_in) { return random_() % one_in == 0; }

  void ask() {
    if (chance(900)) stand_.request(LoopRequest::Kind::kStop);
    if (chance(200)) stand_.request(LoopRequest::Kind::kRecover);
    if (chance(20'000)) stand_.request(LoopRequest::Kind::kForeignCommander);
    if (chance(60) && lent_.empty()) {
      // Towards the middle of the range from wherever the arm is.
      auto from = stand_.status().setpoint.q;
      auto by = all(0.0);
      for (std::size_t j = 0; j < kJoints; ++j) by[j] = std::uniform_real_distribution{-0.4, 0.4}(random_)-0.1 * from[j];
      stand_.start(lend(make_trajectory(from, by, ++id_, 400)));
    }
    if (chance(150) && lent_.size() == 1) {
      const auto& [number, before] = lent_.front();
      const auto size = static_cast<std::int64_t>(before->size);
      const auto ahead = static_cast<std::int64_t>(random_() % 200) - 20;
      const auto tick = static_cast<std::size_t>(std::clamp(stand_.status().cursor + ahead, std::int64_t{0}, size - 1));
      auto by = all(0.0);
      for (std::size_t j = 0; j < kJoints; ++j) by[j] = std::uniform_real_distribution{-0.4, 0.4}(random_)-0.1 * before->points[0].q[j];
      const LoopRequest::Join at{chance(20) ? number + 1 : number, chance(20) ? tick + 1 + random_() % 3 : tick};
      if (before->size + 400 < motion::Trajectory::kCapacity) stand_.join(lend(make_joined(*before, tick, by, ++id_)), at);
    }
    if (chance(30'000)) stand_.restart_drives();
    if (chance(20'000)) stand_.drives.block(static_cast<int>(random_() % kJoints));
    if (chance(2'000)) stand_.drives.unblock();
    if (chance(100'000)) stand_.drives.slip(static_cast<int>(random_() % kJoints), chance(2) ? 0.1 : -0.1);
  }

  /// Spoils it now and then, and remembers it until it comes back.
  const motion::Trajectory& lend(std::unique_ptr<motion::Trajectory> trajectory) {
    if (chance(10)) {
      const std::uint64_t bits = random_();
      trajectory->points[random_() % trajectory->size].q[random_() % kJoints] = std::bit_cast<double>(bits);
    }
    if (started_) started_(stand_.started + 1, *trajectory);
    return *lent_.emplace_back(stand_.started + 1, std::move(trajectory)).trajectory;
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
  struct Lent {
    std::uint64_t number;
    std::unique_ptr<motion::Trajectory> trajectory;
    Lent(std::uint64_t with, std::unique_ptr<motion::Trajectory> owned) : number{with}, trajectory{std::move(owned)} {}
  };
  std::vector<Lent> lent_;  ///< to the loop, oldest first
  int bad_spell_ = 0;
  std::uint64_t id_ = 0;
};

}  // namespace breakshot::control::test
