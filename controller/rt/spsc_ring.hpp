#pragma once

#include "controller/rt/exchange.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace breakshot::rt {

/// Bounded queue from one writing thread to one reading thread. Lock-free and wait-free; nothing is overwritten: what does not fit is
/// dropped and counted, so that a reader which falls behind can be seen to.
///
/// @tparam kCapacity  a power of two; all of it is usable, because the indices count on for ever and only their difference is bounded
template <typename T, std::size_t kCapacity>
class SpscRing {
  static_assert(kSelfContained<T>, "the copy must not reach outside of the object: see kSelfContained");
  static_assert(kCapacity != 0 && (kCapacity & (kCapacity - 1)) == 0, "a power of two, so that an index is a mask away");

 public:
  SpscRing() = default;
  SpscRing(const SpscRing&) = delete;
  SpscRing& operator=(const SpscRing&) = delete;
  SpscRing(SpscRing&&) = delete;
  SpscRing& operator=(SpscRing&&) = delete;
  ~SpscRing() = default;

  /// Appends a value. Writing thread only.
  /// @return false when the ring is full; the value is then lost and counted
  bool push(const T& value) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == kCapacity) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    values_[tail & kMask] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Takes the oldest value. Reading thread only.
  /// @return false when the ring is empty; `out` is then left alone
  bool pop(T& out) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    out = values_[head & kMask];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Values lost to a full ring since the start. Any thread.
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::uint64_t kMask = kCapacity - 1;

  alignas(kCacheLine) std::atomic<std::uint64_t> head_{0};
  alignas(kCacheLine) std::atomic<std::uint64_t> tail_{0};
  std::atomic<std::uint64_t> dropped_{0};
  alignas(kCacheLine) std::array<T, kCapacity> values_{};
};

}  // namespace breakshot::rt
