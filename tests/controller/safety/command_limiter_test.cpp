#include "controller/safety/command_limiter.hpp"
#include "controller/safety/joint_brake.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace breakshot::safety {
namespace {

constexpr double kTick = 1e-3;
using Kind = LimitViolation::Kind;

JointLimits test_limits() {
  JointLimits limits;
  limits.joints = 6;
  limits.lower.fill(-2.0);
  limits.upper.fill(2.5);
  limits.max_speed.fill(3.14);
  limits.max_acceleration.fill(10.0);
  return limits;
}

/// A joint that is driven by a random, bounded acceleration and never leaves its limits.
Setpoint random_step(const JointLimits& limits, const Setpoint& last, std::mt19937& random, double span) {
  Setpoint next;
  for (std::size_t j = 0; j < static_cast<std::size_t>(limits.joints); ++j) {
    const double a_max = limits.max_acceleration[j];
    double a = std::uniform_real_distribution{-a_max, a_max}(random);
    const double stop = last.qd[j] * std::abs(last.qd[j]) / (2.0 * a_max);
    if (last.q[j] + stop > limits.upper[j] - 0.1 || last.qd[j] > 3.0) a = -a_max;
    if (last.q[j] + stop < limits.lower[j] + 0.1 || last.qd[j] < -3.0) a = a_max;
    next.q[j] = last.q[j] + last.qd[j] * span + 0.5 * a * span * span;
    next.qd[j] = last.qd[j] + a * span;
    next.qdd[j] = a;
  }
  return next;
}

TEST(CommandLimiter, PassesEveryMotionWithinTheLimits) {
  const auto limits = test_limits();
  std::mt19937 random{1};
  for (int round = 0; round < 20; ++round) {
    Setpoint at{};
    for (int i = 0; i < 5000; ++i) {
      const double span = kTick * (random() % 100 == 0 ? static_cast<double>(1 + random() % 18) : 1.0);
      const Setpoint next = random_step(limits, at, random, span);
      const auto violation = check_command(limits, at, next, span);
      ASSERT_FALSE(violation) << to_string(violation.kind) << " joint " << violation.joint << ": " << violation.value << ", "
                              << violation.limit;
      at = next;
    }
  }
}

// From any sound set-point, any single field that is off by more than rounding is caught, with the joint named.
TEST(CommandLimiter, CatchesEverySingleWrongField) {
  const auto limits = test_limits();
  std::mt19937 random{2};
  Setpoint at{};
  for (int i = 0; i < 20'000; ++i) {
    const Setpoint next = random_step(limits, at, random, kTick);
    const std::size_t j = random() % 6;
    const double sign = random() % 2 == 0 ? 1.0 : -1.0;

    Setpoint jumped = next;
    jumped.q[j] += sign * 1e-4;
    auto violation = check_command(limits, at, jumped, kTick);
    ASSERT_TRUE(violation);
    EXPECT_EQ(violation.joint, static_cast<int>(j));

    Setpoint kicked = next;
    kicked.qd[j] += sign * 0.05;
    violation = check_command(limits, at, kicked, kTick);
    ASSERT_TRUE(violation);
    EXPECT_EQ(violation.joint, static_cast<int>(j));

    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      Setpoint in_q = next, in_qd = next, in_qdd = next;
      in_q.q[j] = bad;
      in_qd.qd[j] = bad;
      in_qdd.qdd[j] = bad;
      EXPECT_EQ(check_command(limits, at, in_q, kTick).kind, Kind::kNotFinite);
      EXPECT_EQ(check_command(limits, at, in_qd, kTick).kind, Kind::kNotFinite);
      EXPECT_EQ(check_command(limits, at, in_qdd, kTick).kind, Kind::kNotFinite);
    }
    at = next;
  }
}

TEST(CommandLimiter, NamesRangeAndSpeed) {
  const auto limits = test_limits();
  Setpoint last{}, next{};
  last.q[3] = 2.4999;
  last.qd[3] = 0.2;
  next = last;
  next.q[3] = 2.5001;
  auto violation = check_command(limits, last, next, kTick);
  EXPECT_EQ(violation.kind, Kind::kPosition);
  EXPECT_EQ(violation.joint, 3);
  EXPECT_EQ(violation.limit, 2.5);

  last = next = Setpoint{};
  last.qd[0] = 3.139;
  next.qd[0] = 3.145;
  next.q[0] = 3.142e-3;
  violation = check_command(limits, last, next, kTick);
  EXPECT_EQ(violation.kind, Kind::kSpeed);
  EXPECT_EQ(violation.joint, 0);
}

// Braking from anywhere: always passes the limiter, ends at rest in the least possible time, stays within the range.
TEST(Brake, IsTheShortestStopWithinTheLimits) {
  const auto limits = test_limits();
  std::mt19937 random{3};
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
  for (int round = 0; round < 2000; ++round) {
    Setpoint at{};
    double longest = 0.0;
    for (std::size_t j = 0; j < 6; ++j) {
      at.qd[j] = uniform(-3.14, 3.14);
      at.q[j] = uniform(-1.4, 1.9);  // the braking distance at full speed is 0.49 rad
      longest = std::max(longest, std::abs(at.qd[j]) / 10.0);
    }
    const Setpoint start = at;
    int ticks = 0;
    while (!at.at_rest()) {
      const Setpoint next = brake(limits, at, kTick);
      const auto violation = check_command(limits, at, next, kTick);
      ASSERT_FALSE(violation) << to_string(violation.kind) << " " << violation.value << " " << violation.limit;
      at = next;
      ASSERT_LE(++ticks, 400);
    }
    EXPECT_NEAR(ticks * kTick, longest, 1.001 * kTick);
    for (std::size_t j = 0; j < 6; ++j) EXPECT_NEAR(at.q[j] - start.q[j], start.qd[j] * std::abs(start.qd[j]) / 20.0, 1e-9);
    EXPECT_EQ(brake(limits, at, kTick).q, at.q) << "at rest it stays";
  }
}

TEST(Brake, StopsAtTheRangeWhenItIsTooNear) {
  const auto limits = test_limits();
  Setpoint at{};
  at.q[0] = 2.45;
  at.qd[0] = 3.0;
  for (int i = 0; i < 400; ++i) at = brake(limits, at, kTick);
  EXPECT_EQ(at.q[0], 2.5);
  EXPECT_TRUE(at.at_rest());
}

TEST(Brake, TakesALongSpanInOneStep) {
  const auto limits = test_limits();
  Setpoint at{};
  at.qd[2] = 1.0;
  const Setpoint next = brake(limits, at, 10.0);
  EXPECT_NEAR(next.q[2], 0.05, 1e-12);
  EXPECT_TRUE(next.at_rest());
}

TEST(Approach, ComesToRestAtTheTargetWithinTheLimits) {
  const auto limits = test_limits();
  std::mt19937 random{4};
  for (int round = 0; round < 500; ++round) {
    Setpoint at{};
    JointArray target{};
    for (std::size_t j = 0; j < 6; ++j) target[j] = std::uniform_real_distribution{-0.5, 0.5}(random);
    for (int i = 0; i < 3000; ++i) {
      const Setpoint next = approach(limits, at, target, 0.5, kTick);
      ASSERT_FALSE(check_command(limits, at, next, kTick));
      for (std::size_t j = 0; j < 6; ++j) ASSERT_LE(std::abs(next.qd[j]), 0.5 + 1e-12);
      at = next;
    }
    for (std::size_t j = 0; j < 6; ++j) {
      EXPECT_NEAR(at.q[j], target[j], 1e-6);
      EXPECT_NEAR(at.qd[j], 0.0, 1e-6);
    }
  }
}

}  // namespace
}  // namespace breakshot::safety
