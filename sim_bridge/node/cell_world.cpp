#include "sim_bridge/node/cell_world.hpp"

#include <stdexcept>

namespace breakshot::sim_bridge {
namespace {

SimSettings begin(SimSettings settings, Time start, std::uint64_t session) {
  settings.start = start;
  settings.session = session;
  return settings;
}

}  // namespace

CellWorld::CellWorld(const ArmDescription& arm, const SimBridgeConfig& config, Time start, std::uint64_t session)
    : config_{config},
      world_{arm, begin(config.sim, start, session)},
      last_state_{world_.joint_state()},
      delay_{config.camera_latency, config.camera_jitter, config.camera.seed},
      next_frame_{start} {}

std::optional<std::string> CellWorld::carry_out(const WorldOrder& order) {
  switch (order.verb) {
    case SimControl::Verb::kReset: try { world_.place(order.discs);
      } catch (const std::invalid_argument& error) {
        return error.what();
      }
      break;
    case SimControl::Verb::kSetFault:
      if (auto wrong = set_fault(order)) return wrong;
      break;
    case SimControl::Verb::kClearFaults:
      faults_.clear();
      world_.block(std::nullopt);
      break;
  }
  world_.weaken_drives(faults_.get(Fault::kDrivesWeak).value_or(1.0));
  control_seq_ = order.control_seq;
  return std::nullopt;
}

std::optional<std::string> CellWorld::set_fault(const WorldOrder& order) {
  if (Fault{order.fault} == Fault::kBlock) {
    if (order.discs.size() != 1)
      return "block: found " + std::to_string(order.discs.size()) + " discs that say where it stands; allowed: 1";
    const SimDisc& shape = order.discs.front();
    try {
      world_.block(Block{shape.p_WD, shape.radius, shape.height});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  }
  return faults_.set(order.fault, order.fault_value);
}

void CellWorld::take(std::span<const JointCommand> commands) {
  if (faults_.has(Fault::kDrivesDeaf)) return;
  for (const JointCommand& command : commands) world_.command(command);
}

std::optional<JointState> CellWorld::published_state() {
  if (faults_.has(Fault::kStatesSilent)) return std::nullopt;
  if (!faults_.has(Fault::kStatesFrozen)) last_state_ = world_.joint_state();
  return last_state_;
}

SimTruth CellWorld::truth() {
  SimTruth truth = world_.truth();
  truth.seq = ++truth_seq_;
  truth.control_seq = control_seq_;
  return truth;
}

std::optional<Shot> CellWorld::shot() {
  const Time now = world_.now();
  if (now < next_frame_) return std::nullopt;
  // The grid of exposures is kept; only a world that slipped past whole periods leaves them out.
  while (next_frame_ <= now) next_frame_ += config_.frame_period;
  if (faults_.has(Fault::kCameraSilent)) return std::nullopt;
  Shot shot;
  world_.snapshot(shot.snapshot);
  shot.seq = ++frame_seq_;
  shot.due = delay_.due(now, from_seconds(faults_.get(Fault::kCameraLate).value_or(0.0)));
  shot.brightness = config_.camera.exposure.brightness * faults_.get(Fault::kCameraDark).value_or(1.0);
  shot.moved = faults_.get(Fault::kCameraMoved).value_or(0.0);
  shot.frozen = faults_.has(Fault::kCameraFrozen);
  return shot;
}

}  // namespace breakshot::sim_bridge
