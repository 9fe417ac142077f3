#pragma once

#include "common/joints.hpp"
#include "common/time.hpp"

#include <array>
#include <cstddef>
#include <mutex>
#include <optional>

namespace breakshot::perception {

/// Where the arm's joints were a moment ago: frames come long after their exposure. Any number of threads may use one.
class JointHistory {
 public:
  /// Keeps the last two seconds of a 1 kHz arm: more than a frame is late on a machine that is far too busy. A new session of the drives, or time that goes back, forgets what was before.
  void add(const JointState& state);

  /// Joint angles at `when`, rad: between two states by their angles and speeds, or at their speed a few milliseconds past the newest. Nothing when `when` is older than
  /// what is kept, newer than that, or in a hole of the stream.
  std::optional<JointVector> at(Time when) const;

 private:
  static constexpr std::size_t kStates = 2048;
  struct Entry {
    Time stamp{};
    JointVector q, qd;
  };
  const Entry& back(std::size_t i) const noexcept { return entries_[(count_ - 1 - i) % kStates]; }  // 0: the newest

  mutable std::mutex mutex_;
  std::array<Entry, kStates> entries_;
  std::size_t count_ = 0;  // ever added since the last start
  std::uint64_t session_ = 0;
};

}  // namespace breakshot::perception
