#include "sim_bridge/arm/servo_drives.hpp"
#include "tests/sim_bridge/cell_arm.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <limits>
#include <random>

namespace breakshot::sim_bridge {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kCommands = 100'000;
#else
constexpr int kCommands = 1'000'000;
#endif

/// A commander whose motion is sound and whose commands are spoilt on the way: lost, late, doubled, out of order, of somebody else, absurd.
class Commander {
 public:
  explicit Commander(const ArmDescription& arm) : arm_{arm} {}

  JointCommand next(Time now, const DriveReference& reference) {
    t_ += 1e-3;
    if (chance(2'000)) anchor(reference);
    JointCommand command;
    command.seq = ++seq_;
    command.session = session_;
    command.due = now + milliseconds{4};
    command.q = command.qd = command.qdd = JointVector::Zero(6);
    for (Eigen::Index i = 0; i < 6; ++i) {
      // Up to the joint's own speed, from where it began towards the middle of its range and back.
      const double speed = std::copysign(share_ * arm_.joints[static_cast<std::size_t>(i)].max_speed, -from_[i]);
      const double omega = 2.0 + static_cast<double>(i);
      command.q[i] = from_[i] + speed / omega * (1.0 - std::cos(omega * t_));
      command.qd[i] = speed * std::sin(omega * t_);
      command.qdd[i] = speed * omega * std::cos(omega * t_);
    }
    return command;
  }

  void spoil(JointCommand& command, Time now) {
    const auto j = static_cast<Eigen::Index>(random_() % 6);
    switch (random_() % 12) {
      case 0: command.q[j] = std::bit_cast<double>(random_()); break;
      case 1: command.qd[j] = std::bit_cast<double>(random_()); break;
      case 2: command.qdd[j] = std::bit_cast<double>(random_()); break;
      case 3: command.q.setConstant(std::numeric_limits<double>::quiet_NaN()); break;
      case 4: command.q[j] += uniform(-1.0, 1.0) * std::pow(10.0, uniform(-5.0, 1.0)); break;
      case 5: command.qd[j] = uniform(-4.0, 4.0); break;
      case 6: command.due = now + microseconds{static_cast<std::int64_t>(uniform(-30'000.0, 120'000.0))}; break;
      case 7: command.due = time_from_ns(std::bit_cast<std::int64_t>(random_())); break;
      case 8: command.seq -= random_() % 4; break;
      case 9: command.session = random_() % 3; break;
      case 10: command.q.conservativeResize(static_cast<Eigen::Index>(random_() % 8)); break;
      default: command.seq = random_(); break;
    }
  }
  bool chance(unsigned one_in) { return random_() % one_in == 0; }
  double uniform(double from, double to) { return std::uniform_real_distribution{from, to}(random_); }
  std::uint64_t random() { return random_(); }

  /// Begins a motion round where the drives are, as a controller does after a stop.
  void anchor(const DriveReference& reference) {
    ++session_;
    seq_ = 0;
    t_ = 0.0;
    share_ = uniform(0.0, 1.0);
    from_ = reference.q;
  }

 private:
  ArmDescription arm_;
  std::mt19937_64 random_{11};
  std::uint64_t seq_ = 0, session_ = 100;
  double t_ = 0.0, share_ = 0.5;
  JointVector from_ = JointVector::Zero(6);
};

// A million commands, most of them spoilt in bad spells: what the motors are told is finite, in range, never faster than a joint may be, and without a
// jump, at every quarter of a millisecond.
TEST(ServoDrivesFuzz, NoCommandMakesTheReferenceBreakALimit) {
  const ArmDescription arm = cell_arm();
  ServoDrives drives{arm, DriveSettings{}, JointVector::Zero(6)};
  Commander commander{arm};
  std::deque<JointCommand> delayed;
  Time now = time_from_ns(1'000'000'000);
  DriveReference last = drives.reference(now);
  int offered = 0, bad_spell = 0, moved = 0;
  std::uint64_t violations = 0;
  constexpr Duration kStep = microseconds{250};
  while (offered < kCommands) {
    drives.watch(now);
    if (bad_spell > 0) --bad_spell;
    if (commander.chance(500)) bad_spell = static_cast<int>(commander.random() % 100);
    const unsigned every = bad_spell > 0 ? 2 : 100;
    const auto offer = [&](const JointCommand& command) {
      drives.take(command, now);
      ++offered;
    };
    JointCommand command = commander.next(now, last);
    if (drives.braked() && drives.holds_still(now) && commander.chance(10)) commander.anchor(last);
    if (commander.chance(every)) commander.spoil(command, now);
    if (commander.chance(every)) {
      delayed.push_back(command);
    } else {
      offer(command);
      if (commander.chance(every)) offer(command);
    }
    // What was held up comes later, in any order.
    while (!delayed.empty() && commander.chance(12)) {
      const auto which = delayed.begin() + static_cast<std::ptrdiff_t>(commander.random() % delayed.size());
      offer(*which);
      delayed.erase(which);
    }

    for (Time t = now; t < now + milliseconds{1}; t += kStep) {
      const DriveReference next = drives.reference(t);
      ASSERT_TRUE(next.q.allFinite() && next.qd.allFinite() && next.qdd.allFinite());
      for (Eigen::Index i = 0; i < 6; ++i) {
        const JointDescription& joint = arm.joints[static_cast<std::size_t>(i)];
        const double most = 1.001 * joint.max_speed + 1e-9;
        const bool broken = next.q[i] < joint.lower || next.q[i] > joint.upper || std::abs(next.qd[i]) > most ||
                            std::abs(next.q[i] - last.q[i]) > most * to_seconds(kStep) + 1e-9;
        violations += broken ? 1 : 0;
        EXPECT_FALSE(broken) << "joint " << i << " q " << last.q[i] << " -> " << next.q[i] << " qd " << next.qd[i] << " after " << offered;
      }
      ASSERT_LT(violations, 5U);
      moved += next.qd.isZero(0.0) ? 0 : 1;
      last = next;
    }
    now += milliseconds{1};
  }
  EXPECT_EQ(violations, 0U);
  for (std::size_t verdict = 0; verdict < kCommandVerdicts; ++verdict) {
    EXPECT_GT(drives.verdicts()[verdict], static_cast<std::uint64_t>(kCommands) / 5'000) << to_string(static_cast<CommandVerdict>(verdict));
  }
  EXPECT_GT(drives.verdicts()[0], static_cast<std::uint64_t>(kCommands) / 4) << "they move most of the time";
  EXPECT_GT(moved, kCommands / 2);
}

}  // namespace
}  // namespace breakshot::sim_bridge
