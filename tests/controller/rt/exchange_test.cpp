#include "controller/rt/spsc_ring.hpp"
#include "controller/rt/triple_buffer.hpp"
#include "controller/rt/wakeup.hpp"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <random>
#include <string>
#include <thread>

namespace breakshot::rt {
namespace {

// Sanitizers slow an exchange by an order of magnitude and find a race in far fewer.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr std::uint64_t kExchanges = 300'000;
#else
constexpr std::uint64_t kExchanges = 5'000'000;
#endif

/// Values that one thread writes for another to read. The environment may ask for more: BREAKSHOT_EXCHANGES=100000000.
std::uint64_t exchanges() {
  const char* const asked = std::getenv("BREAKSHOT_EXCHANGES");
  return asked == nullptr ? kExchanges : std::stoull(asked);
}

/// What an endurance run is worth depends on how many values really went across while both threads ran.
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
  const std::uint64_t count = exchanges();
  TripleBuffer<Payload> buffer;
  std::thread writer{[&] {
    for (std::uint64_t n = 1; n <= count; ++n) buffer.write(Payload::of(n));
  }};
  Payload payload;
  std::uint64_t last = 0;
  std::uint64_t bad = 0;
  std::uint64_t received = 0;
  while (last < count) {
    if (!buffer.read(payload)) continue;
    if (!payload.whole() || payload.number() <= last) ++bad;
    last = payload.number();
    ++received;
  }
  writer.join();
  EXPECT_EQ(bad, 0U);
  EXPECT_EQ(last, count) << "the last value written is the one that stays";
  tell("triple buffer", count, received, 0);
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
  std::atomic<bool> done{false};
  std::thread writer{[&] {
    for (std::uint64_t n = 1; n <= count; ++n) ring.push(Payload::of(n));
    done = true;
  }};
  std::uint64_t received = 0;
  std::uint64_t bad = 0;
  std::uint64_t last = 0;
  const auto drain = [&] {
    Payload payload;
    while (ring.pop(payload)) {
      if (!payload.whole() || payload.number() <= last) ++bad;
      last = payload.number();
      ++received;
    }
  };
  while (!done) drain();
  writer.join();
  drain();
  EXPECT_EQ(bad, 0U);
  EXPECT_EQ(received + ring.dropped(), count);
  tell("ring, writer never waits", count, received, ring.dropped());
}

TEST(SpscRing, LosesNothingWhenTheWriterWaits) {
  SpscRing<std::uint64_t, 4> ring;
  const std::uint64_t count = exchanges();
  std::thread writer{[&] {
    for (std::uint64_t n = 1; n <= count; ++n) {
      while (!ring.push(n)) std::this_thread::yield();
    }
  }};
  for (std::uint64_t expected = 1; expected <= count;) {
    std::uint64_t n = 0;
    if (!ring.pop(n)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(n, expected);
    ++expected;
  }
  writer.join();
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
