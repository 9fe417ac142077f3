#include "controller/rt/realtime.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <thread>
#include <vector>

namespace breakshot::rt {
namespace {

// What this machine grants is not the test's to demand; that each refusal is named with its remedy is, and that no refusal is left unsaid.
TEST(RealtimeSetup, EitherGetsThePriorityOrSaysHowToGrantIt) {
  std::thread{[] {
    const auto missing = make_thread_realtime({.priority = 10});
    const bool is_fifo = sched_getscheduler(0) == SCHED_FIFO;
    EXPECT_EQ(missing.empty(), is_fifo);
    for (const auto& each : missing) {
      EXPECT_NE(each.what.find("SCHED_FIFO priority 10"), std::string::npos);
      EXPECT_NE(each.remedy.find("LimitRTPRIO"), std::string::npos);
      EXPECT_FALSE(each.effect.empty());
    }
  }}.join();
}

TEST(RealtimeSetup, NamesACoreThatIsNotThere) {
  for (const int cpu : {1023, 100'000}) {
    std::thread{[cpu] {
      const auto missing = make_thread_realtime({.priority = 10, .cpu = cpu});
      ASSERT_FALSE(missing.empty());
      EXPECT_NE(missing.back().what.find("core " + std::to_string(cpu)), std::string::npos);
    }}.join();
  }
}

TEST(RealtimeSetup, RefusesAPriorityOutsideTheScheduler) {
  std::thread{[] {
    const auto missing = make_thread_realtime({.priority = 1000});
    ASSERT_FALSE(missing.empty());
    EXPECT_NE(missing.front().what.find("Invalid argument"), std::string::npos);
  }}.join();
}

}  // namespace
}  // namespace breakshot::rt
