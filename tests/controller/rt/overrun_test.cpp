#include "controller/rt/overrun.hpp"

#include <gtest/gtest.h>

namespace breakshot::rt {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

class Judge : public ::testing::Test {
 protected:
  /// A tick of so much wall and CPU time, and the sleep after it.
  void tick(Duration wall, Duration cpu) {
    clock += cpu;
    if (judge.is_late(wall)) {
      judge.late_tick(wall, clock);
    } else {
      judge.tick_in_time(wall);
    }
    clock += microseconds{3};
  }

  OverrunJudge judge{milliseconds{1}};
  Duration clock = milliseconds{500};

  void SetUp() override { judge.read(clock); }
};

TEST_F(Judge, ALateWakeUpIsTheHosts) {
  tick(microseconds{10}, microseconds{10});
  judge.skipped(7);
  EXPECT_EQ(judge.overruns().ours, 0U);
  EXPECT_EQ(judge.overruns().hosts, 7U);
}

TEST_F(Judge, ATickThatComputesTooLongIsOurs) {
  for (int i = 0; i < 99; ++i) tick(microseconds{10}, microseconds{10});
  tick(milliseconds{3}, milliseconds{3});
  judge.skipped(2);
  EXPECT_EQ(judge.overruns().ours, 2U);
  tick(microseconds{10}, microseconds{10});
  judge.skipped(1);
  EXPECT_EQ(judge.overruns().ours, 2U) << "what comes after a tick in time is the host's again";
  EXPECT_EQ(judge.overruns().hosts, 1U);
}

TEST_F(Judge, ATickThatIsHeldUpIsTheHosts) {
  for (int i = 0; i < 99; ++i) tick(microseconds{10}, microseconds{10});
  tick(milliseconds{3}, microseconds{15});
  judge.skipped(2);
  EXPECT_EQ(judge.overruns().ours, 0U);
  EXPECT_EQ(judge.overruns().hosts, 2U);
}

TEST_F(Judge, TicksBeforeItWithMuchWorkAreNotBlamedOnTheLateOne) {
  for (int i = 0; i < 50; ++i) tick(microseconds{900}, microseconds{900});
  tick(milliseconds{3}, microseconds{15});
  judge.skipped(2);
  EXPECT_EQ(judge.overruns().ours, 0U);
}

}  // namespace
}  // namespace breakshot::rt
