#include "controller/rt/realtime.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <cstdint>
#include <fstream>
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

/// What the kernel keeps now, us; -1 when it does not say.
std::int32_t kept_latency() {
  std::int32_t latency = -1;
  std::ifstream{"/dev/cpu_dma_latency", std::ios::binary}.read(reinterpret_cast<char*>(&latency), sizeof latency);
  return latency;
}

TEST(RealtimeSetup, KeepsCoresFromDeepSleepAsLongAsAskedOrSaysHowToGrantIt) {
  const auto before = kept_latency();
  {
    const WakeLatencyLimit limit{7};
    if (limit.missing().empty()) {
      EXPECT_LE(kept_latency(), 7);
      EXPECT_GE(kept_latency(), 0);
    } else {
      EXPECT_NE(limit.missing().front().what.find("/dev/cpu_dma_latency at 7 us"), std::string::npos);
      EXPECT_NE(limit.missing().front().remedy.find("chmod"), std::string::npos);
    }
  }
  EXPECT_EQ(kept_latency(), before);
  EXPECT_TRUE(WakeLatencyLimit{std::nullopt}.missing().empty()) << "nothing asked, nothing missing";
}

}  // namespace
}  // namespace breakshot::rt
