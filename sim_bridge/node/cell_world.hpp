#pragma once

#include "common/config/cell_config.hpp"
#include "common/sim_interface.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/faults.hpp"
#include "sim_bridge/node/camera_feed.hpp"
#include "sim_bridge/node/frame_delay.hpp"
#include "sim_bridge/sim_bridge_config.hpp"
#include "sim_bridge/world/sim_world.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace breakshot::sim_bridge {

/// What a `sim/control` request comes to after the slow part - reading a formation - is done: ready for the physics thread.
struct WorldOrder {
  std::uint64_t control_seq = 0;
  SimControl::Verb verb = SimControl::Verb::kReset;
  std::vector<SimDisc> discs;  ///< of a reset; of Fault::kBlock: where and how big
  std::uint8_t fault = 0;
  double fault_value = 0.0;
  std::string what;  ///< for the log
};

/// The world together with its faults and its camera's rhythm: what the physics thread owns, whatever drives that thread. Knows no DDS.
class CellWorld {
 public:
  CellWorld(const ArmDescription& arm, const SimBridgeConfig& config, Time start, std::uint64_t session);

  /// Carries an order out. @return what is wrong with it, or nothing
  std::optional<std::string> carry_out(const WorldOrder& order);
  void place(std::span<const SimDisc> discs) { world_.place(discs); }

  /// Offers commands to the drives, unless they are deaf.
  void take(std::span<const JointCommand> commands);
  void tick() { world_.tick(); }
  void slip(Duration by) noexcept { world_.slip(by); }

  /// The joint state as it is to be published; nothing when that is broken.
  std::optional<JointState> published_state();
  SimTruth truth();

  /// The picture that is to be taken now, if any. To be asked once per tick.
  std::optional<Shot> shot();

  Time now() const noexcept { return world_.now(); }
  const SimWorld& world() const noexcept { return world_; }
  const Faults& faults() const noexcept { return faults_; }

 private:
  std::optional<std::string> set_fault(const WorldOrder& order);

  SimBridgeConfig config_;
  SimWorld world_;
  Faults faults_;
  JointState last_state_;
  std::uint64_t control_seq_ = 0;
  std::uint64_t truth_seq_ = 0;
  std::uint64_t frame_seq_ = 0;
  FrameDelay delay_;
  Time next_frame_;
};

}  // namespace breakshot::sim_bridge
