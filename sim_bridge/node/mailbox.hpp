#pragma once

#include "common/time.hpp"

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace breakshot::sim_bridge {

/// Hands values from DDS threads to one other thread, or the other way round. A lock that is held for a vector's push or swap only.
template <typename T>
class Mailbox {
 public:
  /// @param capacity  values beyond it push out the oldest
  explicit Mailbox(std::size_t capacity) : capacity_{capacity} { values_.reserve(capacity); }

  void put(T value) {
    {
      const std::lock_guard lock{mutex_};
      if (values_.size() == capacity_) values_.erase(values_.begin());
      values_.push_back(std::move(value));
    }
    came_.notify_one();
  }

  /// Swaps all values into `out`, oldest first; `out` is emptied before and keeps its memory. Never waits, not even for the lock: while somebody is just putting
  /// a value in, `out` stays empty and the values are there for the next call.
  void take_all(std::vector<T>& out) {
    out.clear();
    const std::unique_lock lock{mutex_, std::try_to_lock};
    if (lock.owns_lock()) values_.swap(out);
  }

  /// As take_all(), but waits for at least one value, a wake() or the time-out.
  void wait_all(std::vector<T>& out, Duration timeout) {
    out.clear();
    std::unique_lock lock{mutex_};
    came_.wait_for(lock, timeout, [&] { return !values_.empty() || woken_; });
    woken_ = false;
    values_.swap(out);
  }

  void wake() {
    {
      const std::lock_guard lock{mutex_};
      woken_ = true;
    }
    came_.notify_one();
  }

 private:
  const std::size_t capacity_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<T> values_;
  bool woken_ = false;
};

}  // namespace breakshot::sim_bridge
