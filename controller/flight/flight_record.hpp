#pragma once

#include "common/result.hpp"
#include "controller/loop/flight_tap.hpp"
#include "controller/loop/loop_config.hpp"
#include "controller/motion/trajectory.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot::control::flight {

/// Why a record was written.
enum class Trigger : std::uint8_t {
  kRefusal = 0,  ///< a stroke was refused, before or at its start, or a recovery
  kStop = 1,     ///< a controlled or protective stop began, or a stroke was given up
  kFault = 2,    ///< ... and only a restart leaves it
};
inline constexpr std::size_t kTriggers = 3;

/// Of one record; two seconds hold a few. A bound, because each takes 2.8 MB in memory.
inline constexpr std::size_t kMaxTrajectories = 32;

/// Some seconds of the control loop: everything that a replay needs to give the same commands again, bit for bit.
struct FlightRecord {
  Trigger trigger = Trigger::kStop;
  std::string why;                 ///< for people
  std::uint64_t trigger_tick = 0;  ///< the tick that it happened in; 0 when it happened elsewhere
  std::int64_t written_utc_ns = 0;
  LoopConfig config;
  Keyframe start;
  /// By LoopRequest::trajectory_number.
  std::map<std::uint64_t, std::shared_ptr<const motion::Trajectory>> trajectories;
  std::vector<TickRecord> ticks;  ///< without a gap; the first is start.tick
};

/// As the bytes of a file: a header with the length and a checksum, then the contents.
std::string encode(const FlightRecord& record);
/// Puts the header before contents of whatever kind.
std::string with_checksum(std::string_view contents);

/// @return the record, or why these bytes are none: of another kind or version, cut off, damaged, or inconsistent
Result<FlightRecord, std::string> decode(std::string_view bytes);

/// "refusal", "stop", "fault"; "invalid" for a value outside the enumeration.
const char* to_string(Trigger trigger) noexcept;

}  // namespace breakshot::control::flight
