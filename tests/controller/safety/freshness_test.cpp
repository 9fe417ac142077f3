#include "controller/safety/freshness.hpp"

#include <gtest/gtest.h>

#include <random>

namespace breakshot::safety {
namespace {

using std::chrono::milliseconds;

class Freshness : public ::testing::Test {
 protected:
  void tick(bool fresh, milliseconds span = milliseconds{1}) {
    now_ += span;
    watchdog_.update(fresh, now_);
  }
  void establish() {
    for (int i = 0; i < limits_.recover_samples; ++i) tick(true);
  }

  FreshnessLimits limits_;
  FreshnessWatchdog watchdog_{limits_};
  Time now_{};
};

TEST_F(Freshness, IsEstablishedAfterAFewGoodStates) {
  for (int i = 1; i < limits_.recover_samples; ++i) {
    tick(true);
    EXPECT_FALSE(watchdog_.established());
    EXPECT_TRUE(watchdog_.stale());
  }
  tick(true);
  EXPECT_TRUE(watchdog_.established());
  EXPECT_FALSE(watchdog_.stale());
}

TEST_F(Freshness, PredictsFromTheFifthTickAndIsStaleFromTheTwentieth) {
  establish();
  for (int missed = 1; missed <= 40; ++missed) {
    tick(false);
    EXPECT_EQ(watchdog_.predicted(), missed >= 5) << missed;
    EXPECT_EQ(watchdog_.stale(), missed >= 20) << missed;
  }
  EXPECT_TRUE(watchdog_.established()) << "once is once";
}

TEST_F(Freshness, AFreezeOfTheHostIsOneTick) {
  establish();
  tick(false, milliseconds{18});
  EXPECT_FALSE(watchdog_.predicted());
  tick(true);
  EXPECT_FALSE(watchdog_.stale());
}

TEST_F(Freshness, TimeHasABoundOfItsOwn) {
  establish();
  tick(false, milliseconds{99});
  EXPECT_FALSE(watchdog_.stale());
  tick(false, milliseconds{1});
  EXPECT_TRUE(watchdog_.stale());
}

TEST_F(Freshness, OneStrayStateDoesNotEndAGap) {
  establish();
  for (int i = 0; i < 30; ++i) tick(false);
  for (int i = 0; i < 100; ++i) {
    tick(true);
    EXPECT_TRUE(watchdog_.stale());
    for (int k = 0; k < 5; ++k) tick(false);
  }
  // A state every other tick, as jitter makes it, is good enough.
  for (int i = 0; i < limits_.recover_samples; ++i) {
    tick(true);
    tick(false);
  }
  EXPECT_FALSE(watchdog_.stale());
}

// Any pattern of arrivals: never stale without a reason, always stale with one.
TEST_F(Freshness, IsStaleExactlyByItsRule) {
  std::mt19937 random{1};
  establish();
  int gap = 0;
  int good = 0;
  bool stale = false;
  Time last = now_;
  for (int i = 0; i < 200'000; ++i) {
    const bool fresh = random() % 100 < ((i / 1000) % 3 == 0 ? 10U : 90U);
    tick(fresh, milliseconds{1 + (random() % 200 == 0 ? static_cast<int>(random() % 120) : 0)});
    if (fresh) {
      gap = 0;
      last = now_;
      if (stale && ++good == limits_.recover_samples) stale = false;
    } else {
      ++gap;
      if (gap >= limits_.predict_ticks) good = 0;
      if (gap >= limits_.stop_ticks || now_ - last >= limits_.stop_after) {
        stale = true;
        good = 0;
      }
    }
    ASSERT_EQ(watchdog_.stale(), stale) << "tick " << i;
    ASSERT_EQ(watchdog_.predicted(), gap >= limits_.predict_ticks);
  }
}

}  // namespace
}  // namespace breakshot::safety
