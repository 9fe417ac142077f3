#include "tests/controller/loop/call_counter.hpp"
#include "tests/controller/loop/syscall_watch.hpp"
#include "tests/controller/loop/watched_run.hpp"

#include "controller/rt/histogram.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace breakshot::control::test {
namespace {

TEST(CallCounter, SeesTheHeapAndTheMutex) {
  if (!counting_works()) GTEST_SKIP() << "sanitizers replace the same functions";
  start_counting();
  void* volatile block = std::malloc(10);  // volatile: the optimiser drops a pair that nobody can see
  std::free(block);
  static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  pthread_mutex_lock(&mutex);
  pthread_mutex_unlock(&mutex);
  const auto counts = stop_counting();
  EXPECT_EQ(counts.heap, 2U);
  EXPECT_EQ(counts.mutexes, 2U);
}

TEST(SyscallWatch, SeesASystemCallAndLetsItThrough) {
  if (!watch_syscalls()) GTEST_SKIP() << "needs Linux 5.11 on x86-64, without a sanitizer";
  begin_span();
  const long pid = syscall(SYS_getpid);
  end_span();
  EXPECT_EQ(pid, getpid());
  EXPECT_EQ(syscall_counts().calls, 1U);
  EXPECT_EQ(syscall_counts().first, SYS_getpid);
}

TEST(Sins, SeesAPageFault) {
  constexpr std::size_t kBytes = 1UL << 20U;
  void* const fresh = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(fresh, MAP_FAILED);
  Sins sins;
  sins.watch([&] { *static_cast<volatile char*>(fresh) = 1; });
  EXPECT_GE(sins.faults, 1);
  munmap(fresh, kBytes);
}

// Not one heap call, lock, system call or page fault in a million ticks. The time of a tick is recorded as a property of the test.
TEST(ControlLoopRealtime, AMillionTicksWithoutHeapLockSystemCallOrPageFault) {
  if (!counting_works()) GTEST_SKIP() << "sanitizers replace the same functions";
  const WatchedRun run = run_watched(1'000'000, 1);
  EXPECT_EQ(run.sins.calls.heap, 0U);
  EXPECT_EQ(run.sins.calls.mutexes, 0U);
  EXPECT_EQ(run.sins.system.calls, 0U) << "the first was system call " << run.sins.system.first;
  if (run.watched_faults) {
    EXPECT_EQ(run.sins.faults, 0);
  }
  // A virtual machine's CPU clock may count what its host took (18 ms in one tick, on a busy one). A tick that is too long by itself is so in every one of its kind.
  EXPECT_LE(run.overruns.ours, 10U);
  EXPECT_EQ(run.dropped, 0U);
  EXPECT_GT(run.started, 250);
  EXPECT_GT(run.joined, 50);
  EXPECT_GT(run.stopped, 250);
  EXPECT_GT(run.refused, 50);
  EXPECT_GT(run.recovered, 250);
  EXPECT_GT(run.restarted, 50);
  const auto ns = [](Duration span) { return static_cast<int>(span.count()); };
  const rt::Histogram& compute = run.compute;
  RecordProperty("tick_cpu_p50_ns", ns(compute.quantile(0.5)));
  RecordProperty("tick_cpu_p999_ns", ns(compute.quantile(0.999)));
  RecordProperty("tick_cpu_max_ns", ns(compute.max()));
  std::printf("watched: heap, mutexes%s%s\n", run.watched_system_calls ? ", system calls" : "", run.watched_faults ? ", page faults" : "");
  std::printf("tick, CPU time of the thread: p50 %d ns, p99 %d ns, p99.9 %d ns, p99.99 %d ns, max %d ns\n", ns(compute.quantile(0.5)),
              ns(compute.quantile(0.99)), ns(compute.quantile(0.999)), ns(compute.quantile(0.9999)), ns(compute.max()));
}

}  // namespace
}  // namespace breakshot::control::test
