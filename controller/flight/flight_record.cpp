#include "controller/flight/flight_record.hpp"

#include "controller/flight/loop_fields.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace breakshot::control::flight {

namespace {

constexpr std::string_view kMagic = "breakshot flight";
constexpr std::uint32_t kVersion = 3;
constexpr std::size_t kHeader = kMagic.size() + sizeof(std::uint32_t) + sizeof(std::uint64_t) + sizeof(std::uint32_t);

std::uint32_t checksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

template <typename Code, Is<FlightRecord> T>
void head(Code& code, T& record) {
  code.below(record.trigger, kTriggers);
  code(record.why, record.trigger_tick, record.written_utc_ns, record.config, record.start.tick);
}

std::shared_ptr<const motion::Trajectory> read_trajectory(ByteReader& code) {
  auto trajectory = std::make_shared<motion::Trajectory>();
  code(*trajectory);
  return trajectory;
}

/// What decode() promises beyond the values of the single fields: whatever the loop is led to look at is there.
void check(const FlightRecord& record, const ByteReader& code) {
  const LoopMemory& memory = record.start.memory;
  const auto joints = record.config.limits.joints;
  if (joints < 1) code.refuse("an arm without joints");
  if (record.config.period <= Duration::zero()) code.refuse("a period that is not above zero");
  const auto check_state = [&](const JointState& state) {
    for (const JointVector* q : {&state.q, &state.qd}) {
      if (q->size() != 0 && q->size() != joints) code.refuse("a remembered state with another number of joints than the arm");
    }
  };
  check_state(memory.state_);
  std::for_each(memory.past_states_.begin(), memory.past_states_.end(), check_state);
  if (memory.trajectory_number_ != 0) {
    const auto found = record.trajectories.find(memory.trajectory_number_);
    if (found == record.trajectories.end())
      code.refuse(fmt::format("no trajectory {}, which runs at the start", memory.trajectory_number_));
    const auto size = static_cast<std::int64_t>(found->second->size);
    if (size == 0 || memory.cursor_ < -1 || memory.cursor_ >= size)
      code.refuse(fmt::format("tick {} of a trajectory of {}", memory.cursor_, size));
    if (found->second->joints != joints) code.refuse("a running trajectory with another number of joints than the arm");
    if (!std::isfinite(memory.path_stop_.path_position()) || memory.path_stop_.path_position() < 0.0) {
      code.refuse("a stop that is nowhere on its path");
    }
    if (!memory.path_pace_.sound()) code.refuse("a path speed that no motion has");
  } else if (memory.motion_ == LoopMemory::Motion::kOnTrajectory || memory.motion_ == LoopMemory::Motion::kStoppingOnPath ||
             memory.motion_ == LoopMemory::Motion::kSettling || memory.motion_ == LoopMemory::Motion::kPaced) {
    code.refuse("a motion along a trajectory, and no trajectory");
  }
  if (memory.next_number_ != 0) {
    const auto found = record.trajectories.find(memory.next_number_);
    if (found == record.trajectories.end()) code.refuse(fmt::format("no trajectory {}, which is to follow", memory.next_number_));
    if (found->second->size == 0 || found->second->joints != joints) code.refuse("a trajectory to follow that does not fit the arm");
    if (memory.motion_ != LoopMemory::Motion::kOnTrajectory || memory.join_tick_ < std::max<std::int64_t>(memory.cursor_, 0)) {
      code.refuse("a trajectory to follow where none can");
    }
  }
  for (std::size_t i = 0; i < record.ticks.size(); ++i) {
    const TickRecord& tick = record.ticks[i];
    if (tick.tick != record.start.tick + i) code.refuse(fmt::format("tick {} in the place of {}", tick.tick, record.start.tick + i));
    for (std::size_t r = 0; r < tick.requests; ++r) {
      if (tick.request[r].kind != LoopRequest::Kind::kStart || record.trajectories.contains(tick.request[r].trajectory_number)) continue;
      code.refuse(fmt::format("no trajectory {}, which tick {} is asked to start", tick.request[r].trajectory_number, tick.tick));
    }
  }
}

FlightRecord read(ByteReader& code) {
  FlightRecord record;
  head(code, record);
  record.start.memory = LoopMemory{record.config};
  code(record.start.memory);
  std::uint32_t count = 0;
  code(count);
  if (count > kMaxTrajectories) code.refuse(fmt::format("{} trajectories; allowed: 0 to {}", count, kMaxTrajectories));
  for (std::uint32_t i = 0; i < count; ++i) {
    std::uint64_t number = 0;
    code(number);
    record.trajectories[number] = read_trajectory(code);
  }
  code(count);
  for (std::uint32_t i = 0; i < count; ++i) code(record.ticks.emplace_back());
  if (code.left() != 0) code.refuse(fmt::format("{} bytes after the last tick", code.left()));
  check(record, code);
  return record;
}

}  // namespace

std::string with_checksum(std::string_view contents) {
  ByteWriter header;
  header(kVersion, std::uint64_t{contents.size()}, checksum(contents));
  return std::string{kMagic} + header.bytes() + std::string{contents};
}

std::string encode(const FlightRecord& record) {
  ByteWriter contents;
  head(contents, record);
  contents(record.start.memory, static_cast<std::uint32_t>(record.trajectories.size()));
  for (const auto& [number, trajectory] : record.trajectories) contents(number, *trajectory);
  contents(static_cast<std::uint32_t>(record.ticks.size()));
  for (const TickRecord& tick : record.ticks) contents(tick);
  return with_checksum(contents.bytes());
}

Result<FlightRecord, std::string> decode(std::string_view bytes) {
  if (bytes.substr(0, kMagic.size()) != kMagic.substr(0, bytes.size()))
    return std::string{"this is no flight record: it does not begin as one"};
  if (bytes.size() < kHeader) return fmt::format("cut off: {} bytes, and the header alone takes {}", bytes.size(), kHeader);
  std::uint32_t version = 0;
  std::uint64_t size = 0;
  std::uint32_t sum = 0;
  ByteReader header{bytes.substr(kMagic.size(), kHeader - kMagic.size())};
  header(version, size, sum);
  if (version != kVersion) return fmt::format("a flight record of version {}; this program reads version {}", version, kVersion);
  const std::string_view contents = bytes.substr(kHeader);
  if (contents.size() < size) return fmt::format("cut off: {} bytes of contents, and the header says {}", contents.size(), size);
  if (contents.size() > size) return fmt::format("{} bytes too many behind the contents", contents.size() - size);
  if (checksum(contents) != sum) return fmt::format("damaged: the checksum is {:08x}, and the header says {:08x}", checksum(contents), sum);
  try {
    ByteReader reader{contents};
    return read(reader);
  } catch (const RecordError& error) {
    return std::string{error.what()};
  }
}

const char* to_string(Trigger trigger) noexcept {
  switch (trigger) {
    case Trigger::kRefusal: return "refusal";
    case Trigger::kStop: return "stop";
    case Trigger::kFault: return "fault";
  }
  return "invalid";
}

}  // namespace breakshot::control::flight
