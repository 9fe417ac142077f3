#include "controller/safety/following_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace breakshot::safety {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr FollowingLimits kLimits{.floor = 0.05, .per_speed = 0.04};

/// Joint j follows sin(w t + j), so speed and position are known at every instant.
Setpoint command_at(double t) {
  Setpoint setpoint;
  for (std::size_t j = 0; j < 6; ++j) {
    setpoint.q[j] = std::sin(2.0 * t + static_cast<double>(j));
    setpoint.qd[j] = 2.0 * std::cos(2.0 * t + static_cast<double>(j));
  }
  return setpoint;
}

JointState measured(Time stamp, const Setpoint& at) {
  JointState state;
  state.stamp = stamp;
  state.q = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(at.q.data());
  state.qd = JointVector::Zero(6);
  state.tau = JointVector::Zero(6);
  return state;
}

class Following : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int k = 0; k < 200; ++k) monitor_.sent(Time{milliseconds{k}}, command_at(k * 1e-3));
  }
  /// The states of these tests come from drives that lag by this.
  static constexpr Duration kLag = milliseconds{2};
  FollowingError check(JointState state) const {
    state.stamp += kLag;
    return monitor_.check(state, kLag);
  }
  FollowingMonitor monitor_{6, kLimits};
};

TEST_F(Following, ComparesWithTheCommandOfTheSameInstant) {
  std::mt19937 random{1};
  for (int i = 0; i < 2000; ++i) {
    const Time stamp{microseconds{140'000 + static_cast<int>(random() % 70'000)}};  // also up to 10 ms past the newest command
    EXPECT_EQ(check(measured(stamp, command_at(to_seconds(stamp.time_since_epoch())))).joint, -1);
  }
}

TEST_F(Following, NamesTheJointThatIsFurthestOut) {
  std::mt19937 random{2};
  for (int i = 0; i < 2000; ++i) {
    const Time stamp{microseconds{140'000 + static_cast<int>(random() % 59'000)}};
    const Setpoint expected = command_at(to_seconds(stamp.time_since_epoch()));
    auto state = measured(stamp, expected);
    const int j = static_cast<int>(random() % 6);
    const double limit = 0.05 + 0.04 * std::abs(expected.qd[static_cast<std::size_t>(j)]);
    const double sign = random() % 2 == 0 ? 1.0 : -1.0;
    const double before = state.q[j];
    state.q[j] = before + sign * 0.97 * limit;
    EXPECT_EQ(check(state).joint, -1);
    state.q[j] = before + sign * 1.05 * limit;
    const auto error = check(state);
    EXPECT_EQ(error.joint, j);
    EXPECT_NEAR(error.error, sign * 1.05 * limit, 1e-3);
    EXPECT_NEAR(error.limit, limit, 1e-3);
  }
}

TEST_F(Following, SaysNothingOfInstantsItDoesNotRemember) {
  EXPECT_EQ(check(measured(Time{milliseconds{100}}, Setpoint{})).joint, -1);
  monitor_.clear();
  EXPECT_EQ(check(measured(Time{milliseconds{199}}, Setpoint{})).joint, -1);
}

}  // namespace
}  // namespace breakshot::safety
