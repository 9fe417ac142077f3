#include "controller/rt/periodic_timer.hpp"

#include <gtest/gtest.h>

#include <cerrno>
#include <random>

namespace breakshot::rt {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

static_assert(settle_wakeup(Time{milliseconds{5}}, milliseconds{1}, Time{milliseconds{5}}).skipped == 0);
static_assert(settle_wakeup(Time{milliseconds{5}}, milliseconds{1}, Time{milliseconds{6}}).due == Time{milliseconds{6}});

static_assert(TimerTick{Time{milliseconds{9}}, Time{microseconds{9'300}}, 4}.lateness(milliseconds{1}) == microseconds{4'300});

// The overrun policy, for any sequence of late wake-ups and long ticks: on the grid for ever, never two ticks in one period, every period
// accounted for, and the tick that runs is the one of the period in which the thread woke.
TEST(OverrunPolicy, KeepsPhaseSkipsWholePeriodsAndNeverBursts) {
  std::mt19937_64 random{1};
  for (int round = 0; round < 500; ++round) {
    const Duration period{1 + static_cast<std::int64_t>(random() % 5'000'000)};
    const Time start{Duration{static_cast<std::int64_t>(random() % 1'000'000'000)}};
    Time clock = start - Duration{static_cast<std::int64_t>(random() % 1000)};
    Time next = start;
    std::uint64_t ticks = 0;
    std::uint64_t skipped = 0;
    Time last_due = start - period;
    for (int i = 0; i < 500; ++i) {
      // The sleep ends at the instant or later; now and then much later. A clock read may also lie just before it.
      clock = std::max(clock, next);
      if (random() % 10 == 0) clock += Duration{static_cast<std::int64_t>(random() % (20 * static_cast<std::uint64_t>(period.count())))};
      const Time woke = random() % 50 == 0 && clock == next ? clock - Duration{1} : clock;

      const Wakeup wakeup = settle_wakeup(next, period, woke);
      ASSERT_EQ((wakeup.due - start) % period, Duration::zero());
      ASSERT_GE(wakeup.due, last_due + period);
      ASSERT_LT(woke - wakeup.due, period);
      ASSERT_EQ(wakeup.due, last_due + static_cast<std::int64_t>(wakeup.skipped + 1) * period);

      ++ticks;
      skipped += wakeup.skipped;
      last_due = wakeup.due;
      next = wakeup.due + period;
      // The tick's own work: short mostly, an overrun now and then.
      clock += random() % 20 == 0 ? 3 * period / 2 : period / 10;
    }
    EXPECT_EQ((last_due - start) / period, static_cast<std::int64_t>(ticks + skipped) - 1);
  }
}

TEST(PeriodicTimer, WakesOnItsGridAndNeverEarly) {
  const Duration period = std::chrono::microseconds{100};
  const Time start = monotonic_now();
  PeriodicTimer timer{period, start};
  Time last = start - period;
  for (int i = 0; i < 100; ++i) {
    const TimerTick tick = timer.wait();
    ASSERT_EQ(tick.error, 0);
    EXPECT_EQ((tick.due - start) % period, Duration::zero());
    EXPECT_EQ(tick.due - last, static_cast<std::int64_t>(tick.skipped + 1) * period);
    EXPECT_GE(tick.woke, tick.due);
    last = tick.due;
  }
}

TEST(PeriodicTimer, ReportsTheErrorNumberThatTheCallReturns) {
  PeriodicTimer timer{milliseconds{1}, time_from_ns(-1)};  // a negative time is EINVAL
  EXPECT_EQ(timer.wait().error, EINVAL);
}

TEST(Clocks, RunForward) {
  const Time before = monotonic_now();
  const Duration cpu_before = thread_cpu_now();
  EXPECT_GE(monotonic_now(), before);
  EXPECT_GE(thread_cpu_now(), cpu_before);
}

}  // namespace
}  // namespace breakshot::rt
