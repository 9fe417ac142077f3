#pragma once

#include "controller/flight/flight_record.hpp"
#include "controller/loop/channels.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace breakshot::control::flight {

/// Where a replay first parts from what was recorded.
struct Difference {
  std::uint64_t tick = 0;
  std::string what;  ///< "command.q of joint 3: replayed 0.123 (0x...), recorded 0.124 (0x...)"
};

struct ReplayResult {
  std::uint64_t ticks = 0;     ///< replayed, up to and with the first difference
  std::uint64_t commands = 0;  ///< of them, ticks that sent one
  std::optional<Difference> difference;
};

/// Feeds a record through a control loop and compares every command and decision with the recorded one, bit for bit.
///
/// @param observe  gets every event as the replayed loop posts it; may be empty
/// Needs some 3 MB per trajectory; runs some hundred thousand ticks a second.
ReplayResult replay(const FlightRecord& record, const std::function<void(const LoopEvent&)>& observe = {});

}  // namespace breakshot::control::flight
