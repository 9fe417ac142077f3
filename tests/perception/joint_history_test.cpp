#include "perception/joint_history.hpp"

#include <gtest/gtest.h>

namespace breakshot::perception {
namespace {

double angle(double ms) { return 10e-6 * ms * ms; }

Time at_ms(double ms) { return time_from_ns(static_cast<std::int64_t>(1e6 * ms)); }

// One joint that speeds up at 20 rad/s^2.
JointState state(double ms, std::uint64_t session = 1) {
  JointState s;
  s.session = session;
  s.stamp = at_ms(ms);
  s.q = JointVector::Constant(1, angle(ms));
  s.qd = JointVector::Constant(1, 20e-3 * ms);
  return s;
}

TEST(JointHistory, KnowsWhereTheJointsWereBetweenStatesAndJustAfterTheNewest) {
  JointHistory history;
  for (int ms = 1; ms <= 100; ++ms) {
    if (ms <= 50 || ms > 80) history.add(state(ms));  // a few are lost
  }
  for (const double ms : {1.0, 34.0, 34.25, 60.0, 99.9, 100.0}) {
    const auto q = history.at(at_ms(ms));
    ASSERT_TRUE(q) << ms;
    EXPECT_NEAR((*q)[0], angle(ms), 1e-9) << ms;
  }
  const auto ahead = history.at(at_ms(107.5));
  ASSERT_TRUE(ahead);
  EXPECT_NEAR((*ahead)[0], angle(107.5), 1e-3);
}

TEST(JointHistory, SaysNothingWhereItDoesNotKnow) {
  JointHistory history;
  EXPECT_FALSE(history.at(at_ms(0)));
  for (int ms = 1; ms <= 4000; ++ms) {
    if (ms <= 3900 || ms > 3960) history.add(state(ms));
  }
  EXPECT_FALSE(history.at(at_ms(4011))) << "the future";
  EXPECT_FALSE(history.at(at_ms(1000))) << "long ago";
  EXPECT_FALSE(history.at(at_ms(3925))) << "a hole in the stream";
  EXPECT_TRUE(history.at(at_ms(3899.5)));
}

TEST(JointHistory, StartsAnewWithTheDrives) {
  JointHistory history;
  for (int ms = 1; ms <= 50; ++ms) history.add(state(ms));
  history.add(state(51, 2));
  EXPECT_FALSE(history.at(at_ms(40)));
  EXPECT_TRUE(history.at(at_ms(51)));
  history.add(state(10, 2));
  EXPECT_FALSE(history.at(at_ms(51))) << "time went back";
  EXPECT_TRUE(history.at(at_ms(10)));
}

}  // namespace
}  // namespace breakshot::perception
