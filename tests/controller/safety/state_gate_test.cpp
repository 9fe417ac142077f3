#include "controller/safety/state_gate.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace breakshot::safety {
namespace {

using std::chrono::milliseconds;

constexpr int kJoints = 6;

StateLimits test_limits() {
  StateLimits limits;
  limits.joints.joints = kJoints;
  limits.joints.lower.fill(-3.0);
  limits.joints.upper.fill(3.0);
  limits.joints.max_speed.fill(3.14);
  limits.joints.max_acceleration.fill(10.0);
  return limits;
}

class Gate : public ::testing::Test {
 protected:
  static JointState state_at(std::uint64_t seq, Time stamp) {
    JointState state;
    state.seq = seq;
    state.session = 1;
    state.stamp = stamp;
    state.q = JointVector::Constant(kJoints, 0.5);
    state.qd = JointVector::Zero(kJoints);
    state.tau = JointVector::Zero(kJoints);
    return state;
  }
  StateFlaw judge(const JointState& state) { return gate_.judge(state, state.stamp).flaw; }
  /// The first session confirms itself, with seq below 10.
  void SetUp() override {
    for (std::uint64_t k = 1; k <= 5; ++k) judge(state_at(k, t0_ - milliseconds{100} + k * milliseconds{1}));
    ASSERT_EQ(gate_.counts()[0], 1U);
  }

  StateGate gate_{test_limits()};
  Time t0_{milliseconds{1000}};
};

TEST_F(Gate, LetsGoodStatesPass) {
  for (std::uint64_t k = 10; k < 110; ++k) EXPECT_EQ(judge(state_at(k, t0_ + k * milliseconds{1})), StateFlaw::kNone);
  EXPECT_EQ(gate_.counts()[0], 101U);
}

TEST_F(Gate, LostStatesAreNoFlawOfTheNextOne) {
  EXPECT_EQ(judge(state_at(11, t0_)), StateFlaw::kNone);
  EXPECT_EQ(judge(state_at(500, t0_ + milliseconds{499})), StateFlaw::kNone);
}

TEST_F(Gate, NamesDuplicatesAndReorderedOnes) {
  EXPECT_EQ(judge(state_at(7, t0_)), StateFlaw::kNone);
  EXPECT_EQ(judge(state_at(7, t0_)), StateFlaw::kDuplicate);
  EXPECT_EQ(judge(state_at(6, t0_ + milliseconds{1})), StateFlaw::kReordered);
  EXPECT_EQ(judge(state_at(8, t0_)), StateFlaw::kReordered) << "a clock that stands still";
  EXPECT_EQ(judge(state_at(8, t0_ - milliseconds{1})), StateFlaw::kReordered) << "a clock that runs backwards";
}

TEST_F(Gate, JudgesAge) {
  const auto limits = test_limits();
  EXPECT_EQ(gate_.judge(state_at(11, t0_), t0_ + limits.max_age).flaw, StateFlaw::kNone);
  EXPECT_EQ(gate_.judge(state_at(12, t0_ + milliseconds{1}), t0_ + milliseconds{2} + limits.max_age).flaw, StateFlaw::kLate);
  EXPECT_EQ(gate_.judge(state_at(13, t0_ + milliseconds{50}), t0_ + milliseconds{49} - limits.max_ahead).flaw, StateFlaw::kFromFuture);
}

TEST_F(Gate, RefusesWhatIsNoMeasurement) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  std::uint64_t seq = 10;
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const double bad : {nan, infinity, -infinity}) {
      auto in_q = state_at(++seq, t0_);
      in_q.q[joint] = bad;
      EXPECT_EQ(judge(in_q), StateFlaw::kNotFinite);
      auto in_qd = state_at(++seq, t0_);
      in_qd.qd[joint] = bad;
      EXPECT_EQ(judge(in_qd), StateFlaw::kNotFinite);
      auto in_tau = state_at(++seq, t0_);
      in_tau.tau[joint] = bad;
      EXPECT_EQ(judge(in_tau), StateFlaw::kNotFinite);
    }
    for (const double sign : {-1.0, 1.0}) {
      auto far = state_at(++seq, t0_);
      far.q[joint] = sign * 3.21;
      EXPECT_EQ(judge(far), StateFlaw::kOutOfRange);
      auto fast = state_at(++seq, t0_);
      fast.qd[joint] = sign * 6.3;
      EXPECT_EQ(judge(fast), StateFlaw::kOutOfRange);
    }
  }
  auto short_q = state_at(++seq, t0_);
  short_q.q.conservativeResize(kJoints - 1);
  EXPECT_EQ(judge(short_q), StateFlaw::kWrongJoints);
  auto seven = state_at(++seq, t0_);
  seven.q = seven.qd = seven.tau = JointVector::Zero(7);
  EXPECT_EQ(judge(seven), StateFlaw::kWrongJoints);
  // None of them counts as seen: the first good one may carry any number.
  EXPECT_EQ(judge(state_at(11, t0_)), StateFlaw::kNone);
}

TEST_F(Gate, BelievesALeapOnlyWhenTimeMakesItPossible) {
  auto leapt = state_at(11, t0_);
  EXPECT_EQ(judge(leapt), StateFlaw::kNone);
  leapt.q[4] += 0.3;  // at twice 3.14 rad/s it takes 46 ms
  for (std::uint64_t k = 1; k <= 60; ++k) {
    leapt.seq = 11 + k;
    leapt.stamp = t0_ + k * milliseconds{1};
    const StateFlaw flaw = judge(leapt);
    EXPECT_EQ(flaw, k <= 46 ? StateFlaw::kLeap : StateFlaw::kNone) << k << " ms";
  }
}

TEST_F(Gate, BelievesARestartWhenItIsConfirmedAndIgnoresStragglers) {
  EXPECT_FALSE(gate_.judge(state_at(1000, t0_), t0_).new_session);
  auto restarted = state_at(1, t0_ + milliseconds{2});
  restarted.session = 2;
  restarted.q.setConstant(-1.0);  // a simulator's arm starts at home again
  for (int k = 1; k <= 10; ++k) {
    const auto verdict = gate_.judge(restarted, restarted.stamp);
    EXPECT_EQ(verdict.flaw, k < 5 ? StateFlaw::kNewSession : StateFlaw::kNone);
    EXPECT_EQ(verdict.new_session, k == 5);
    ++restarted.seq;
    restarted.stamp += milliseconds{1};
  }
  EXPECT_EQ(judge(state_at(1001, t0_ + milliseconds{3})), StateFlaw::kOldSession);
}

TEST_F(Gate, DoesNotBelieveSessionsThatCountNothingUp) {
  auto stranger = state_at(1, t0_);
  for (std::uint64_t k = 0; k < 100; ++k) {
    stranger.session = 1000 + k;  // another one each time
    EXPECT_EQ(judge(stranger), StateFlaw::kNewSession);
    stranger.stamp += milliseconds{1};
  }
  stranger.session = 7;
  for (int k = 0; k < 100; ++k) EXPECT_EQ(judge(stranger), StateFlaw::kNewSession) << "the same sample again";
  EXPECT_EQ(judge(state_at(11, t0_ + milliseconds{200})), StateFlaw::kNone) << "the session that was there is still believed";
}

// Rubbish of every kind: whatever passes is finite, in range, newer than all before it of its session, and of the right age.
TEST_F(Gate, WhateverPassesIsSound) {
  std::mt19937_64 random{1};
  const auto limits = test_limits();
  std::uint64_t last_seq = 10;
  std::uint64_t last_session = 1;
  Time last_stamp{};
  JointVector last_q = state_at(1, t0_).q;
  Time now = t0_;
  std::uint64_t passed = 0;
  for (int i = 0; i < 300'000; ++i) {
    now += milliseconds{random() % 3};
    auto state = state_at(last_seq + random() % 4 - 1, now + milliseconds{static_cast<int>(random() % 24) - 14});
    state.session = random() % 1000 == 0 ? random() % 5 : last_session;
    if (random() % 8 == 0) state.q[0] += 0.2;
    if (random() % 8 == 0) state.q[static_cast<int>(random() % kJoints)] = std::bit_cast<double>(random());
    if (random() % 8 == 0) state.qd[static_cast<int>(random() % kJoints)] = std::bit_cast<double>(random());
    const auto verdict = gate_.judge(state, now);
    if (verdict.flaw != StateFlaw::kNone) continue;
    ++passed;
    ASSERT_TRUE(state.q.allFinite() && state.qd.allFinite());
    ASSERT_LE(state.q.cwiseAbs().maxCoeff(), 3.0 + limits.position_margin);
    ASSERT_LE(state.qd.cwiseAbs().maxCoeff(), 3.14 * limits.speed_factor);
    ASSERT_LE(now - state.stamp, limits.max_age);
    ASSERT_LE(state.stamp - now, limits.max_ahead);
    if (passed > 1) {
      ASSERT_GT(state.seq, last_seq);
      ASSERT_GT(state.stamp, last_stamp);
      ASSERT_LE((state.q - last_q).cwiseAbs().maxCoeff(), 6.28 * to_seconds(state.stamp - last_stamp) + limits.leap_margin);
    }
    ASSERT_FALSE(verdict.new_session) << "no stray session is ever confirmed";
    ASSERT_EQ(state.session, 1U);
    last_q = state.q;
    last_seq = state.seq;
    last_session = state.session;
    last_stamp = state.stamp;
  }
  EXPECT_GT(passed, 1000U);
}

}  // namespace
}  // namespace breakshot::safety
