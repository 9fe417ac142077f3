#pragma once

#include "controller/safety/joint_setpoint.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace breakshot::safety {

/// How far the arm may be from where it was told to be, per joint: floor + per_speed * |commanded speed| (the shape is LinuxCNC's).
struct FollowingLimits {
  double floor = 0.012;      ///< rad: twice what the hardest hit on heavy discs costs, three times what 19 lost commands do
  double per_speed = 0.002;  ///< s: a drive that lags by so much time is still in order
};

/// A joint that is out of bounds.
struct FollowingError {
  int joint = -1;      ///< -1: none
  double error = 0.0;  ///< measured minus commanded, rad
  double limit = 0.0;  ///< rad
};

/// Remembers the last commands by their due stamps and compares them with what the drives measured at the same instant - not with the newest
/// command, which the drives cannot have reached yet.
class FollowingMonitor {
 public:
  FollowingMonitor(int joints, const FollowingLimits& limits) noexcept : joints_{joints}, limits_{limits} {}

  /// Forgets all commands: the set-point started anew.
  void clear() noexcept { count_ = 0; }
  /// Takes a command as sent. `due` rises from call to call.
  void sent(Time due, const Setpoint& setpoint) noexcept;
  /// The worst joint that is out of bounds. None for an instant before the oldest command; after the newest the arm is to go on at its speed,
  /// as the drives do.
  /// @param lag  the arm is where the command of so long before was
  FollowingError check(const JointState& state, Duration lag) const noexcept;

  /// Position and speed that the commands ask for at an instant: between two of them by linear interpolation, after the newest straight on. None
  /// for an instant before the oldest one that is remembered.
  std::optional<Setpoint> commanded(Time at) const noexcept;

  /// What it remembers, for the flight recorder.
  template <typename Self, typename Code>
  static void fields(Self& self, Code& code) {
    for (auto& entry : self.entries_) code(entry.due, entry.q, entry.qd);
    code.below(self.next_, kHistory);
    code.below(self.count_, kHistory + 1);
  }

 private:
  static constexpr std::size_t kHistory = 64;  // ticks: more than any transport delay that the gate lets through

  struct Entry {
    Time due{};
    JointArray q{};
    JointArray qd{};
  };
  /// How far back the newest command lies that was due at an instant; count_ when it is forgotten or there was none.
  std::size_t last_due_by(Time at) const noexcept;
  const Entry& newest(std::size_t back) const noexcept { return entries_[(next_ + kHistory - 1 - back) % kHistory]; }

  int joints_;
  FollowingLimits limits_;
  std::array<Entry, kHistory> entries_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace breakshot::safety
