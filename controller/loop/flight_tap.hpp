#pragma once

#include "common/joints.hpp"
#include "controller/loop/channels.hpp"
#include "controller/loop/loop_memory.hpp"
#include "controller/rt/spsc_ring.hpp"
#include "controller/safety/fail_safe.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace breakshot::control {

/// Most requests that one tick takes; what else waits in the channel is the next tick's.
inline constexpr std::size_t kRequestsPerTick = 4;

/// A request as the flight recorder keeps it: the trajectory by its number, since its buffer will hold another one soon.
struct RequestRecord {
  LoopRequest::Kind kind = LoopRequest::Kind::kStop;
  std::uint64_t trajectory_number = 0;
  LoopRequest::Join join{};
};

/// What one tick took and gave.
struct TickRecord {
  std::uint64_t tick = 0;  ///< counts the loop's ticks from 1
  Time now{};
  bool came = false;  ///< a state came
  JointState state;   ///< as it came, before any judgement
  std::size_t requests = 0;
  std::array<RequestRecord, kRequestsPerTick> request{};

  JointCommand command;
  safety::Action action = safety::Action::kHold;
  safety::CauseSet causes;
  LoopMemory::Motion motion = LoopMemory::Motion::kReleased;
  std::uint64_t stroke_id = 0;
  std::uint16_t told = 0;  ///< bit per LoopEvent::Kind that the tick posted

  bool has_told(LoopEvent::Kind kind) const noexcept { return (told >> static_cast<unsigned>(kind) & 1U) != 0; }
};

/// The loop's memory before a tick: where a replay can begin.
struct Keyframe {
  std::uint64_t tick = 0;  ///< the tick that came next
  LoopMemory memory{LoopConfig{}};
};

}  // namespace breakshot::control

namespace breakshot::rt {

// Their vectors have a fixed capacity, and the pointers in a LoopMemory are not followed: a copy stays within the object.
template <>
inline constexpr bool kSelfContained<control::TickRecord> = true;
template <>
inline constexpr bool kSelfContained<control::Keyframe> = true;

}  // namespace breakshot::rt

namespace breakshot::control {

/// The flight recorder's end on the real-time thread: two rings, allocated once (3 MB), that a writer thread empties every few milliseconds.
/// When it does not come for four seconds, records are dropped; the gap shows in TickRecord::tick.
struct FlightTap {
  /// Between two keyframes: the most by which a recording is longer than asked, and copying one (9 kB) stays rare.
  static constexpr std::uint64_t kKeyframeEvery = 250;

  rt::SpscRing<TickRecord, 4096> ticks;
  rt::SpscRing<Keyframe, 32> keyframes;
};

}  // namespace breakshot::control
