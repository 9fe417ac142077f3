#include "controller/flight/replay.hpp"

#include "controller/loop/control_loop.hpp"

#include <fmt/format.h>

#include <bit>
#include <memory>

namespace breakshot::control::flight {

namespace {

std::string differs(const std::string& what, double replayed, double recorded) {
  return fmt::format("{}: replayed {:.17g} ({:#x}), recorded {:.17g} ({:#x})", what, replayed, std::bit_cast<std::uint64_t>(replayed),
                     recorded, std::bit_cast<std::uint64_t>(recorded));
}

template <typename T>
std::optional<std::string> compare(const char* what, T replayed, T recorded) {
  if (replayed == recorded) return std::nullopt;
  return fmt::format("{}: replayed {}, recorded {}", what, replayed, recorded);
}

std::optional<std::string> compare(const char* what, const JointVector& replayed, const JointVector& recorded) {
  if (replayed.size() != recorded.size()) return fmt::format("{}: replayed {} joints, recorded {}", what, replayed.size(), recorded.size());
  for (Eigen::Index i = 0; i < replayed.size(); ++i) {
    if (std::bit_cast<std::uint64_t>(replayed[i]) == std::bit_cast<std::uint64_t>(recorded[i])) continue;
    return differs(fmt::format("{} of joint {}", what, i + 1), replayed[i], recorded[i]);
  }
  return std::nullopt;
}

std::optional<std::string> compare(const TickRecord& replayed, const TickRecord& recorded) {
  const JointCommand& a = replayed.command;
  const JointCommand& b = recorded.command;
  if (auto difference = compare("command.seq", a.seq, b.seq)) return difference;
  if (auto difference = compare("command.session", a.session, b.session)) return difference;
  if (auto difference = compare("command.state_seq", a.state_seq, b.state_seq)) return difference;
  if (auto difference = compare("command.due", to_ns(a.due), to_ns(b.due))) return difference;
  if (auto difference = compare("command.q", a.q, b.q)) return difference;
  if (auto difference = compare("command.qd", a.qd, b.qd)) return difference;
  if (auto difference = compare("command.qdd", a.qdd, b.qdd)) return difference;
  if (auto difference = compare("action", to_string(replayed.action), to_string(recorded.action))) return difference;
  if (auto difference = compare("causes", replayed.causes.bits(), recorded.causes.bits())) return difference;
  if (auto difference = compare("motion", static_cast<int>(replayed.motion), static_cast<int>(recorded.motion))) return difference;
  if (auto difference = compare("stroke", replayed.stroke_id, recorded.stroke_id)) return difference;
  return compare("events", replayed.told, recorded.told);
}

}  // namespace

ReplayResult replay(const FlightRecord& record, const std::function<void(const LoopEvent&)>& observe) {
  const auto channels = std::make_unique<LoopChannels>();
  const auto tap = std::make_unique<FlightTap>();
  ControlLoop loop{record.config, *channels, tap.get()};
  const auto trajectory = [&](std::uint64_t number) {
    const auto found = record.trajectories.find(number);
    return found == record.trajectories.end() ? nullptr : found->second.get();
  };
  loop.restore(record.start.memory, trajectory(record.start.memory.trajectory_number_), trajectory(record.start.memory.next_number_));

  ReplayResult result;
  TickRecord replayed;
  Keyframe keyframe;
  LoopEvent event;
  const motion::Trajectory* returned = nullptr;
  for (const TickRecord& recorded : record.ticks) {
    for (std::size_t i = 0; i < recorded.requests; ++i) {
      const RequestRecord& request = recorded.request[i];
      channels->requests.push({request.kind, trajectory(request.trajectory_number), request.trajectory_number, request.join});
    }
    loop.tick(recorded.came ? &recorded.state : nullptr, recorded.now);
    ++result.ticks;
    const bool ticked = tap->ticks.pop(replayed);
    while (tap->keyframes.pop(keyframe)) {
    }
    while (channels->events.pop(event)) {
      if (observe) observe(event);
    }
    while (channels->returns.pop(returned)) {
    }
    auto difference =
        ticked ? compare(replayed, recorded) : std::optional<std::string>{"the loop took the instant for one that it has had"};
    if (difference) {
      result.difference = Difference{recorded.tick, std::move(*difference)};
      return result;
    }
    if (recorded.command.q.size() > 0) ++result.commands;
  }
  return result;
}

}  // namespace breakshot::control::flight
