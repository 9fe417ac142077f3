#include "tests/controller/loop/harness.hpp"
#include "tests/controller/loop/storm.hpp"

#include "controller/safety/command_limiter.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace breakshot::control::test {
namespace {

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kTicks = 100'000;
#else
constexpr int kTicks = 1'000'000;
#endif

safety::Setpoint setpoint_of(const JointCommand& command) {
  safety::Setpoint setpoint;
  std::copy_n(command.q.data(), kJoints, setpoint.q.begin());
  std::copy_n(command.qd.data(), kJoints, setpoint.qd.begin());
  std::copy_n(command.qdd.data(), kJoints, setpoint.qdd.begin());
  return setpoint;
}

TEST(ControlLoopFuzz, NoCommandEverBreaksALimitOrJumps) {
  const auto config = test_config();
  Storm storm{1};
  const auto tally = storm.run(kTicks, [&](const Stand& stand, const JointCommand& before) {
    const JointCommand& after = stand.last;
    if (after.q.size() == 0) return;
    const auto next = setpoint_of(after);
    ASSERT_TRUE(after.q.allFinite() && after.qd.allFinite() && after.qdd.allFinite());
    ASSERT_LE(after.qd.cwiseAbs().maxCoeff(), 3.14 + 1e-6);
    if (before.q.size() > 0 && after.seq == before.seq + 1) {
      const auto violation = safety::check_command(config.limits, setpoint_of(before), next, to_seconds(after.due - before.due));
      // The one exception is a set-point that starts anew, and that one is where the arm is (or at the end of its range, when it is past it).
      if (violation) {
        const JointVector arm = stand.drives.state().q.cwiseMax(config.limits.lower[0]).cwiseMin(config.limits.upper[0]);
        const double off = (after.q - arm).cwiseAbs().maxCoeff();
        ASSERT_LT(off, 3.14 * 0.013) << to_string(violation.kind) << " of joint " << violation.joint << ": " << violation.value;
      }
    }
  });
  EXPECT_GT(tally.done, kTicks / 20'000);
  EXPECT_GT(tally.joined, kTicks / 20'000);
  EXPECT_GT(tally.stopped, kTicks / 20'000);
  EXPECT_GT(tally.recovered, kTicks / 20'000);
  EXPECT_GT(tally.refused, kTicks / 20'000);
  EXPECT_GT(tally.commands, static_cast<std::uint64_t>(kTicks) / 2);
}

TEST(ControlLoopFuzz, TheSameInputsGiveTheSameCommandsBitForBit) {
  const auto record = [] {
    std::vector<double> trace;
    Storm storm{2};
    storm.run(kTicks / 10, [&](const Stand& stand, const JointCommand&) {
      trace.push_back(static_cast<double>(stand.last.seq));
      for (Eigen::Index j = 0; j < stand.last.q.size(); ++j) {
        trace.push_back(stand.last.q[j]);
        trace.push_back(stand.last.qd[j]);
      }
    });
    return trace;
  };
  EXPECT_EQ(record(), record());
}

}  // namespace
}  // namespace breakshot::control::test
