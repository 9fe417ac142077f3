#pragma once

#include "common/time.hpp"

namespace breakshot::safety {

/// How long the controller does without a fresh joint state.
///
/// The bounds count ticks that ran, because a host that freezes drives and controller together for 18 ms (shared machines do) costs one tick and
/// no information; time has a bound of its own.
struct FreshnessLimits {
  int predict_ticks = 5;  ///< from here on no motion starts; one that runs slows down along its path
  int stop_ticks = 20;    ///< from here on: controlled stop (libfranka stops after as many lost packets)
  Duration stop_after = std::chrono::milliseconds{100};
  int recover_samples = 5;  ///< good samples, without a new gap of predict_ticks, until states count as fresh again
};

/// Watches that fresh joint states keep coming. Starts out stale, and not established.
class FreshnessWatchdog {
 public:
  explicit FreshnessWatchdog(const FreshnessLimits& limits) noexcept : limits_{limits} {}

  /// Once per tick: whether a good state came with it.
  void update(bool fresh, Time now) noexcept;

  /// The states have been fresh at least once since the start.
  bool established() const noexcept { return established_; }
  bool predicted() const noexcept { return ticks_without_ >= limits_.predict_ticks; }
  bool stale() const noexcept { return stale_; }

  /// What it remembers, for the flight recorder.
  template <typename Self, typename Code>
  static void fields(Self& self, Code& code) {
    code(self.established_, self.stale_, self.ticks_without_, self.samples_, self.last_fresh_);
  }

 private:
  FreshnessLimits limits_;
  bool established_ = false;
  bool stale_ = true;
  int ticks_without_ = 0;
  int samples_ = 0;  ///< good ones since the states went stale
  Time last_fresh_{};
};

}  // namespace breakshot::safety
