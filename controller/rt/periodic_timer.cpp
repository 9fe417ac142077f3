#include "controller/rt/periodic_timer.hpp"

#include <cerrno>
#include <ctime>

namespace breakshot::rt {

namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

std::int64_t read_clock(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

}  // namespace

Time monotonic_now() noexcept { return time_from_ns(read_clock(CLOCK_MONOTONIC)); }

Duration thread_cpu_now() noexcept { return Duration{read_clock(CLOCK_THREAD_CPUTIME_ID)}; }

TimerTick PeriodicTimer::wait() noexcept {
  const timespec until{to_ns(next_) / kNsPerSecond, to_ns(next_) % kNsPerSecond};
  // clock_nanosleep does not set errno: it returns a positive error number. EINTR is a signal's; the absolute instant makes resuming exact.
  int error = 0;
  do {
    error = clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
  } while (error == EINTR);
  if (error != 0) return {next_, next_, 0, error};

  const Time woke = monotonic_now();
  const Wakeup wakeup = settle_wakeup(next_, period_, woke);
  next_ = wakeup.due + period_;
  return {wakeup.due, woke, wakeup.skipped, 0};
}

}  // namespace breakshot::rt
