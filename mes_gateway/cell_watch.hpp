#pragma once

#include "common/health.hpp"
#include "common/time.hpp"

#include <map>
#include <string>
#include <vector>

namespace breakshot::mes {

/// Knows from `cell/health` whether the processes that an order needs are there and well.
class CellWatch {
 public:
  /// @param needed  process names, e.g. "controller"
  CellWatch(std::vector<std::string> needed, Duration silent_after) : needed_{std::move(needed)}, silent_after_{silent_after} {}

  void on_health(const Health& health, Time now);

  /// Empty when all is well, else the first process that is not and why.
  std::string what_is_missing(Time now) const;
  /// Why a process says that it is stopped; empty when it does not say so, or is silent.
  std::string what_stopped(const std::string& process, Time now) const;
  /// Last word of a process; null before the first.
  const Health* of(const std::string& process) const;

 private:
  struct Heard {
    Health health;
    Time when;
  };
  std::vector<std::string> needed_;
  Duration silent_after_;
  std::map<std::string, Heard> heard_;
};

}  // namespace breakshot::mes
