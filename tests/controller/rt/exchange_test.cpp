#include "controller/rt/spsc_ring.hpp"
#include "controller/rt/triple_buffer.hpp"
#include "controller/rt/wakeup.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace breakshot::rt {
namespace {

/// Values that one thread reads of those that another writes: 300,000, or what the environment asks for (BREAKSHOT_EXCHANGES=100000000).
std::uint64_t exchanges() {
  const char* const asked = std::getenv("BREAKSHOT_EXCHANGES");
  return asked == nullptr ? 300'000 : std::stoull(asked);
}

/// Where others keep the two threads from running at the same time, little goes over per time slice: then what goes over in some seconds must do, unless
/// a number was asked for.
class Enough {
 public:
  bool operator()() const { return !asked_ && std::chrono::steady_clock::now() > until_; }

 private:
  bool asked_ = std::getenv("BREAKSHOT_EXCHANGES") != nullptr;
  std::chrono::steady_clock::time_point until_ = std::chrono::steady_clock::now() + std::chrono::seconds{10};
};

/// A writer that is so far ahead of its reader gives way now and then, or on a busy machine it would write whole time slices long for nobody.
constexpr std::uint64_t kFarAhead = 4;

/// Cores that this process may use.
std::vector<int> cores() {
  cpu_set_t allowed;
  std::vector<int> found;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return found;
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(core, &allowed)) found.push_back(core);
  }
  return found;
}

/// Keeps the calling thread to a core. Left alone, the scheduler likes to put two threads that give way to each other on one, where nothing can tear.
void stay_on(int core) {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(core, &one);
  ASSERT_EQ(pthread_setaffinity_np(pthread_self(), sizeof one, &one), 0);
}

/// Gives way now and then. Seldom where the other side has a core of its own: it answers within a microsecond. By sleep: newer kernels (6.18 here) take
/// from whoever yields the rest of its share, which on a busy machine leaves it next to nothing.
class Patience {
 public:
  void wait() {
    if (++calls_ % every_ == 0) std::this_thread::sleep_for(std::chrono::microseconds{50});
  }

 private:
  unsigned every_ = cores().size() > 1 ? 1U << 16U : 64U;
  unsigned calls_ = 0;
};

/// Runs a writer and a reader on two threads, and on two cores if there are two.
void side_by_side(const std::function<void()>& write, const std::function<void()>& read) {
  std::thread writer{[&] {
    stay_on(cores().front());
    write();
  }};
  std::thread reader{[&] {
    stay_on(cores().back());
    read();
  }};
  writer.join();
  reader.join();
}

void tell(const char* what, std::uint64_t written, std::uint64_t read, std::uint64_t dropped) {
  std::printf("%s: %" PRIu64 " written, %" PRIu64 " read, %" PRIu64 " dropped and counted\n", what, written, read, dropped);
}

/// Big enough (a joint state's size) that a torn copy would show: every word follows from the first.
struct Payload {
  std::array<std::uint64_t, 26> words{};

  static Payload of(std::uint64_t n) noexcept {
    Payload payload;
    for (std::size_t i = 0; i < payload.words.size(); ++i) payload.words[i] = n * (2 * i + 1);
    return payload;
  }
  std::uint64_t number() const noexcept { return words[0]; }
  bool whole() const noexcept {
    for (std::size_t i = 1; i < words.size(); ++i) {
      if (words[i] != words[0] * (2 * i + 1)) return false;
    }
    return true;
  }
};

TEST(TripleBuffer, GivesTheNewestValueOnce) {
  TripleBuffer<int> buffer{7};
  int out = 0;
  EXPECT_FALSE(buffer.read(out));
  EXPECT_EQ(buffer.latest(), 7);
  buffer.write(1);
  buffer.write(2);
  EXPECT_TRUE(buffer.read(out));
  EXPECT_EQ(out, 2);
  EXPECT_FALSE(buffer.read(out));
  EXPECT_EQ(buffer.latest(), 2);
}

// Against the obvious model, over random interleavings on one thread.
TEST(TripleBuffer, BehavesLikeAVariableWithAFreshMark) {
  std::mt19937 random{1};
  TripleBuffer<int> buffer{0};
  int model = 0;
  bool fresh = false;
  for (int i = 1; i <= 100'000; ++i) {
    if (random() % 2 == 0) {
      buffer.write(i);
      model = i;
      fresh = true;
    } else {
      int out = -1;
      ASSERT_EQ(buffer.read(out), fresh);
      if (fresh) {
        ASSERT_EQ(out, model);
      }
      fresh = false;
      ASSERT_EQ(buffer.latest(), model);
    }
  }
}

TEST(TripleBuffer, NeverTearsNorGoesBackBetweenTwoThreads) {
  std::uint64_t count = exchanges();
  TripleBuffer<Payload> buffer;
  // Relaxed: what is tested must get no help in its synchronisation.
  std::atomic<std::uint64_t> last_read{0};
  std::atomic<bool> done{false};
  std::uint64_t written = 0;
  std::uint64_t bad = 0;
  const auto write = [&] {
    Patience patience;
    while (!done.load(std::memory_order_relaxed)) {
      buffer.write(Payload::of(++written));
      if (written > last_read.load(std::memory_order_relaxed) + kFarAhead) patience.wait();
    }
  };
  const auto read = [&] {
    Patience patience;
    const Enough enough;
    Payload payload;
    for (std::uint64_t received = 0; received < count;) {
      if (!buffer.read(payload)) {
        patience.wait();
        continue;
      }
      if (!payload.whole() || payload.number() <= last_read.load(std::memory_order_relaxed)) ++bad;
      last_read.store(payload.number(), std::memory_order_relaxed);
      ++received;
      if (received % 64 == 0 && enough()) count = received;
    }
    done.store(true, std::memory_order_relaxed);
  };
  side_by_side(write, read);
  EXPECT_EQ(bad, 0U);
  EXPECT_EQ(buffer.latest().number(), written) << "the last value written is the one that stays";
  tell("triple buffer", written, count, 0);
}

TEST(SpscRing, BehavesLikeABoundedQueue) {
  std::mt19937 random{2};
  SpscRing<int, 8> ring;
  std::deque<int> model;
  std::uint64_t dropped = 0;
  for (int i = 0; i < 100'000; ++i) {
    // A bias that changes slowly, so that both full and empty rings are met often.
    if (random() % 100 < ((i / 500) % 2 == 0 ? 60U : 40U)) {
      const bool fits = model.size() < 8;
      ASSERT_EQ(ring.push(i), fits);
      if (fits) {
        model.push_back(i);
      } else {
        ++dropped;
      }
    } else {
      int out = -1;
      ASSERT_EQ(ring.pop(out), !model.empty());
      if (!model.empty()) {
        ASSERT_EQ(out, model.front());
        model.pop_front();
      }
    }
  }
  EXPECT_GT(dropped, 0U);
  EXPECT_EQ(ring.dropped(), dropped);
}

TEST(SpscRing, DeliversInOrderAndCountsEveryLoss) {
  const std::uint64_t count = exchanges();
  SpscRing<Payload, 64> ring;
  std::atomic<bool> enough{false};
  std::uint64_t written = 0;
  std::uint64_t received = 0;
  std::uint64_t bad = 0;
  std::uint64_t last = 0;
  const auto write = [&] {
    Patience patience;
    while (!enough.load(std::memory_order_relaxed)) {
      if (!ring.push(Payload::of(++written))) patience.wait();
    }
  };
  const auto take = [&] {
    Payload payload;
    if (!ring.pop(payload)) return false;
    if (!payload.whole() || payload.number() <= last) ++bad;
    last = payload.number();
    ++received;
    return true;
  };
  const auto read = [&] {
    Patience patience;
    while (received < count) {
      if (!take()) patience.wait();
    }
    enough.store(true, std::memory_order_relaxed);
  };
  side_by_side(write, read);
  while (take()) {
  }
  EXPECT_EQ(bad, 0U);
  EXPECT_EQ(received + ring.dropped(), written);
  tell("ring, writer never waits", written, received, ring.dropped());
}

TEST(SpscRing, LosesNothingWhenTheWriterWaits) {
  std::atomic<std::uint64_t> count{exchanges()};
  SpscRing<Payload, 4> ring;
  std::uint64_t bad = 0;
  const auto write = [&] {
    Patience patience;
    const Enough enough;
    for (std::uint64_t n = 1; n <= count; ++n) {
      const Payload payload = Payload::of(n);
      while (!ring.push(payload)) patience.wait();
      if (n % 64 == 0 && enough()) count = n;
    }
  };
  const auto read = [&] {
    Patience patience;
    Payload payload;
    for (std::uint64_t expected = 1; expected <= count;) {
      if (!ring.pop(payload)) {
        patience.wait();
        continue;
      }
      if (!payload.whole() || payload.number() != expected) ++bad;
      ++expected;
    }
  };
  side_by_side(write, read);
  EXPECT_EQ(bad, 0U);
  EXPECT_GE(count, 64U);
  tell("ring, writer waits for room", count, count, 0);
}

TEST(WakeupSignal, WakesOnceForAllSignalsSoFar) {
  WakeupSignal signal;
  EXPECT_FALSE(signal.wait(Duration::zero()));
  signal.notify();
  signal.notify();
  EXPECT_TRUE(signal.wait(Duration::zero()));
  EXPECT_FALSE(signal.wait(Duration::zero()));
}

TEST(WakeupSignal, WakesAnotherThread) {
  WakeupSignal signal;
  std::thread waker{[&] { signal.notify(); }};
  EXPECT_TRUE(signal.wait(std::chrono::seconds{60}));
  waker.join();
}

}  // namespace
}  // namespace breakshot::rt
