#pragma once

#include "controller/rt/exchange.hpp"

#include <array>
#include <atomic>
#include <cstdint>

namespace breakshot::rt {

/// Hands the latest value from one writing thread to one reading thread. Wait-free on both sides: each operation is one copy and one
/// atomic exchange, whatever the other side does. Older values that were not read in time are overwritten; that is its purpose.
///
/// Three slots: the writer owns one, the reader owns one, and the third lies in the middle. To publish, the writer swaps its slot with the
/// middle one and marks it fresh; to read, the reader swaps only when the mark is set. No slot is ever owned by both.
template <typename T>
class TripleBuffer {
  static_assert(kSelfContained<T>, "the copy must not reach outside of the object: see kSelfContained");

 public:
  TripleBuffer() = default;
  explicit TripleBuffer(const T& initial) : slots_{Slot{initial}, Slot{initial}, Slot{initial}} {}
  TripleBuffer(const TripleBuffer&) = delete;
  TripleBuffer& operator=(const TripleBuffer&) = delete;
  TripleBuffer(TripleBuffer&&) = delete;
  TripleBuffer& operator=(TripleBuffer&&) = delete;
  ~TripleBuffer() = default;

  /// Publishes a value. Writing thread only.
  void write(const T& value) noexcept {
    slots_[writer_].value = value;
    // acq_rel: the release hands the reader our copy; the acquire makes sure that the reader is done with the slot that we get back.
    const std::uint8_t before = middle_.exchange(static_cast<std::uint8_t>(writer_ | kFresh), std::memory_order_acq_rel);
    writer_ = before & kIndex;
  }

  /// Fetches the newest value. Reading thread only.
  /// @return whether it is one that read() has not given before; `out` is left alone otherwise
  bool read(T& out) noexcept {
    if (!refresh()) return false;
    out = slots_[reader_].value;
    return true;
  }

  /// The newest value, or the initial one before the first write. The reference holds until the next call. Reading thread only.
  const T& latest() noexcept {
    refresh();
    return slots_[reader_].value;
  }

 private:
  static constexpr std::uint8_t kIndex = 0b011;
  static constexpr std::uint8_t kFresh = 0b100;

  struct alignas(kCacheLine) Slot {
    T value{};
  };

  bool refresh() noexcept {
    // relaxed is enough to look: the exchange below synchronises, and a mark seen late only delays the value to the next call.
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    reader_ = middle_.exchange(reader_, std::memory_order_acq_rel) & kIndex;
    return true;
  }

  std::array<Slot, 3> slots_{};
  alignas(kCacheLine) std::uint8_t writer_ = 0;
  alignas(kCacheLine) std::atomic<std::uint8_t> middle_{1};
  alignas(kCacheLine) std::uint8_t reader_ = 2;
};

}  // namespace breakshot::rt
