#include "sim_bridge/world/sim_world.hpp"

#include "sim_bridge/arm/arm_body.hpp"
#include "sim_bridge/world/disc_table.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

/// The rod's lower face on the table or on a disc: stiff and well damped against the arm's inertia at the tip (1 kg and more), and stable
/// at the arm's sub-step (k dt^2 / m = 0.01, d dt / m = 0.25).
constexpr double kGroundStiffness = 2e5;  // N/m
constexpr double kGroundDamping = 1e3;    // N s/m
/// The rod on a block: as hard as a steel tool on a clamped post may be before the arm's own links, which are rigid here, would be what gives.
/// Stable as above.
constexpr double kBlockStiffness = 1e5;  // N/m
constexpr double kBlockDamping = 200.0;  // N s/m
/// The rod's inertia is computed when it comes this near to a disc: what a disc at 20 m/s covers in a sub-step.
constexpr double kReachMargin = 5e-3;  // m

/// The arm's base as the discs meet it: its upright cylinders.
std::vector<DiscTable::Post> posts_of(const LinkDescription& base, const Pose& X_WB) {
  std::vector<DiscTable::Post> posts;
  for (const Shape& shape : base.collisions) {
    if (shape.kind != Shape::Kind::kCylinder) continue;
    const Pose X_WS = X_WB * shape.X_LS;
    const bool upright = std::abs(X_WS.linear()(2, 2)) > 0.999;
    const bool reaches_table = X_WS.translation().z() - 0.5 * shape.size.y() < 1e-3;
    if (upright && reaches_table) posts.push_back({X_WS.translation().head<2>(), shape.size.x()});
  }
  return posts;
}

SimSettings checked(SimSettings settings, const ArmDescription& arm) {
  const auto require = [](bool holds, const char* what) {
    if (!holds) throw std::invalid_argument{std::string{"simulator settings: "} + what};
  };
  const auto joints = static_cast<Eigen::Index>(arm.joints.size());
  require(settings.arm_step > Duration::zero() && settings.arm_step <= std::chrono::microseconds{250} &&
              SimWorld::kTick % settings.arm_step == Duration::zero(),
          "arm_step must divide 1 ms and be at most 0.25 ms");
  require(settings.table_steps >= 1 && settings.table_steps <= 64, "table_steps must be 1 to 64");
  if (settings.q_start.size() == 0) settings.q_start = JointVector::Zero(joints);
  require(settings.q_start.size() == joints && settings.q_start.allFinite(), "q_start must have one finite angle per joint");
  for (Eigen::Index i = 0; i < joints; ++i) {
    const JointDescription& joint = arm.joints[static_cast<std::size_t>(i)];
    require(settings.q_start[i] >= joint.lower && settings.q_start[i] <= joint.upper, "q_start must lie inside the joints' ranges");
  }
  const TablePhysics& p = settings.physics;
  const auto within = [](double value, double lo, double hi) { return value >= lo && value <= hi; };
  require(within(p.friction, 0.0, 2.0) && within(p.friction_spread, 0.0, 0.5), "friction must be 0 to 2, its spread 0 to 0.5");
  require(within(p.restitution, 0.0, 1.0) && within(p.striker_restitution, 0.0, 1.0), "restitution must be 0 to 1");
  require(within(p.bounce_speed, 0.0, 1.0) && within(p.striker_bounce_speed, 0.0, 1.0), "bounce speeds must be 0 to 1 m/s");
  require(within(p.contact_friction, 0.0, 1.0), "contact_friction must be 0 to 1");
  require(within(p.striker_radius, 1e-3, 0.1), "striker_radius must be 1 to 100 mm");
  require(p.contact_time == 0.0 || within(p.contact_time, 1e-5, 1e-2), "contact_time must be 0 or 0.01 to 10 ms");
  require(within(settings.drives.bandwidth, 10.0, 400.0), "drive bandwidth must be 10 to 400 rad/s");
  require(within(settings.drives.rotor_inertia, 1e-3, 10.0), "rotor_inertia must be 0.001 to 10 kg m^2");
  require(within(settings.drives.brake_deceleration, 1.0, 100.0), "brake_deceleration must be 1 to 100 rad/s^2");
  require(settings.drives.lag >= Duration::zero() && settings.drives.lag <= std::chrono::milliseconds{20}, "drive lag must be 0 to 20 ms");
  return settings;
}

}  // namespace

class SimWorld::Implementation {
 public:
  Implementation(const ArmDescription& arm, const SimSettings& settings)
      : settings_{checked(settings, arm)},
        now_{settings.start},
        drives_{arm, settings_.drives, settings_.q_start},
        arm_{arm, settings_.X_WB, settings_.drives, settings_.q_start},
        posts_{posts_of(arm.base, settings_.X_WB)},
        table_{settings_.physics, posts_} {}

  void tick() {
    drives_.watch(now_);
    block_force_ = 0.0;
    const auto steps = kTick / settings_.arm_step;
    for (std::int64_t i = 0; i < steps; ++i) sub_step(now_ + i * settings_.arm_step);
    now_ += kTick;
    ++seq_;
  }

  void sub_step(Time t) {
    const double dt = to_seconds(settings_.arm_step);
    const Vector3 p_WT = arm_.X_WT().translation();
    const Vector3 v_WT = arm_.v_WT();
    StrikerRod rod{.p_W = p_WT.head<2>(), .v_W = v_WT.head<2>(), .tip_z = p_WT.z()};

    Vector3 force_W{0.0, 0.0, stand(rod, v_WT.z())};
    const Vector2 block_force_W = push_off(rod);
    const bool near = table_.within_reach(rod, v_WT.norm() * dt + kReachMargin);
    if (near) rod.mobility = arm_.dynamics().tip_mobility(arm_.posture());
    if (near || !table_.at_rest()) {
      const double table_dt = dt / settings_.table_steps;
      for (int k = 0; k < settings_.table_steps; ++k) {
        const Vector2 v_before = rod.v_W;
        table_.step(rod, table_dt);
        if (!first_strike_ && table_.strikes() > 0) first_strike_ = Strike{t + from_seconds(k * table_dt), rod.p_W, v_before};
        rod.p_W += rod.v_W * table_dt;
      }
      force_W.head<2>() = rod.impulse_W / dt;
    }
    force_W.head<2>() += block_force_W;
    arm_.step(drives_.reference(t), force_W, dt);
  }

  /// Whether the rod stands on top of the block rather than beside it: it overlaps it far in plan and little in height.
  bool on_block(const StrikerRod& rod, double overlap) const noexcept {
    return block_ && overlap > 0.0 && overlap > block_->height - rod.tip_z && rod.tip_z < block_->height;
  }
  double block_overlap(const StrikerRod& rod) const noexcept {
    return block_ ? block_->radius + settings_.physics.striker_radius - (rod.p_W - block_->p_W).norm() : -1.0;
  }

  /// Horizontal force of the block on a rod beside it, N.
  Vector2 push_off(const StrikerRod& rod) noexcept {
    const double overlap = block_overlap(rod);
    if (overlap <= 0.0 || rod.tip_z >= block_->height || on_block(rod, overlap)) return Vector2::Zero();
    const Vector2 n = (rod.p_W - block_->p_W).normalized();
    const double force = std::max(0.0, kBlockStiffness * overlap - kBlockDamping * rod.v_W.dot(n));
    block_force_ = std::max(block_force_, force);
    return force * n;
  }

  /// Upward force on a rod that stands on the table, on the block, or on a disc, which it then presses down, N.
  double stand(const StrikerRod& rod, double v_z) noexcept {
    if (pressed_) {
      table_.press(*pressed_, 0.0);
      pressed_.reset();
    }
    const auto disc = table_.below(rod);
    const double ground = disc ? disc->height : on_block(rod, block_overlap(rod)) ? block_->height : 0.0;
    if (rod.tip_z >= ground) return 0.0;
    const double force = std::max(0.0, kGroundStiffness * (ground - rod.tip_z) - kGroundDamping * v_z);
    if (disc) {
      table_.press(disc->disc, force);
      pressed_ = disc->disc;
    }
    return force;
  }

  void place(std::span<const SimDisc> discs) {
    std::string wrong = check_discs(discs, settings_.physics.table);
    const Vector3 p_WT = arm_.X_WT().translation();
    for (std::size_t i = 0; wrong.empty() && i < discs.size(); ++i) {
      const SimDisc& disc = discs[i];
      const double room = (disc.p_WD - p_WT.head<2>()).norm() - disc.radius - settings_.physics.striker_radius;
      if (room < 0.0 && p_WT.z() < disc.height) wrong = "disc " + std::to_string(i) + " overlaps the striker";
      for (const DiscTable::Post& post : posts_) {
        if ((disc.p_WD - post.p_W).norm() < disc.radius + post.radius) wrong = "disc " + std::to_string(i) + " overlaps the arm's base";
      }
      if (block_ && (disc.p_WD - block_->p_W).norm() < disc.radius + block_->radius)
        wrong = "disc " + std::to_string(i) + " overlaps the block";
    }
    if (!wrong.empty()) throw std::invalid_argument{wrong};
    pressed_.reset();
    first_strike_.reset();
    table_.place(discs);
  }

  void block(const std::optional<Block>& block) {
    std::vector<DiscTable::Post> posts = posts_;
    if (block) {
      if (const std::string wrong = check(*block); !wrong.empty()) throw std::invalid_argument{"block: " + wrong};
      posts.push_back({block->p_W, block->radius});
    }
    block_ = block;
    table_.stand(std::move(posts));
  }

  std::string check(const Block& block) const {
    const auto within = [](double value, double lo, double hi) { return value >= lo && value <= hi; };
    if (!within(block.radius, 1e-3, 0.5)) return "radius " + std::to_string(block.radius) + " m; allowed: 0.001 to 0.5";
    if (!within(block.height, 1e-3, 2.0)) return "height " + std::to_string(block.height) + " m; allowed: 0.001 to 2";
    if (!block.p_W.allFinite() || !settings_.physics.table.contains(block.p_W)) return "its axis is off the table";
    const auto overlaps = [&](const Vector2& p_W, double radius) { return (p_W - block.p_W).norm() < radius + block.radius; };
    const Vector3 p_WT = arm_.X_WT().translation();
    if (p_WT.z() < block.height && overlaps(p_WT.head<2>(), settings_.physics.striker_radius)) return "overlaps the striker";
    for (const DiscTable::Post& post : posts_) {
      if (overlaps(post.p_W, post.radius)) return "overlaps the arm's base";
    }
    for (std::size_t i = 0; i < table_.size(); ++i) {
      const SimDisc disc = table_.state(i);
      if (disc.on_table && overlaps(disc.p_WD, disc.radius)) return "overlaps disc " + std::to_string(i);
    }
    return {};
  }

  SimSettings settings_;
  Time now_;
  std::uint64_t seq_ = 0;
  ServoDrives drives_;
  ArmBody arm_;
  std::vector<DiscTable::Post> posts_;
  DiscTable table_;
  std::optional<std::size_t> pressed_;
  std::optional<Block> block_;
  double block_force_ = 0.0;
  std::optional<Strike> first_strike_;
};

SimWorld::SimWorld(const ArmDescription& arm, const SimSettings& settings)
    : implementation_{std::make_unique<Implementation>(arm, settings)} {}
SimWorld::~SimWorld() = default;
SimWorld::SimWorld(SimWorld&&) noexcept = default;
SimWorld& SimWorld::operator=(SimWorld&&) noexcept = default;

CommandVerdict SimWorld::command(const JointCommand& command) noexcept {
  return implementation_->drives_.take(command, implementation_->now_);
}

void SimWorld::tick() { implementation_->tick(); }
void SimWorld::slip(Duration by) noexcept { implementation_->now_ += by; }
void SimWorld::place(std::span<const SimDisc> discs) { implementation_->place(discs); }
void SimWorld::block(const std::optional<Block>& block) { implementation_->block(block); }
void SimWorld::weaken_drives(double share) noexcept { implementation_->arm_.weaken(share); }
Time SimWorld::now() const noexcept { return implementation_->now_; }

JointState SimWorld::joint_state() const noexcept {
  const Implementation& world = *implementation_;
  return {.seq = world.seq_ + 1,
          .session = world.settings_.session,
          .stamp = world.now_,
          .q = world.arm_.q(),
          .qd = world.arm_.qd(),
          .tau = world.arm_.tau(),
          .command_seq = world.drives_.command_seq(),
          .braked = world.drives_.braked()};
}

void SimWorld::snapshot(WorldSnapshot& into) const {
  const Implementation& world = *implementation_;
  into.stamp = world.now_;
  into.discs.clear();
  for (std::size_t i = 0; i < world.table_.size(); ++i) into.discs.push_back(world.table_.state(i));
  into.X_WL.clear();
  into.V_WL.clear();
  for (int i = 0; i < world.arm_.dynamics().joints(); ++i) {
    into.X_WL.push_back(world.arm_.X_WL(i));
    into.V_WL.push_back({world.arm_.w_WL(i), world.arm_.v_WL(i)});
  }
}

SimTruth SimWorld::truth() const {
  const Implementation& world = *implementation_;
  SimTruth truth;
  truth.stamp = world.now_;
  truth.p_WT = p_WT();
  truth.v_WT_W = v_WT();
  truth.kinetic_energy = kinetic_energy();
  truth.strikes = world.table_.strikes();
  for (std::size_t i = 0; i < world.table_.size(); ++i) truth.discs.push_back(world.table_.state(i));
  return truth;
}

const std::optional<Strike>& SimWorld::first_strike() const noexcept { return implementation_->first_strike_; }
bool SimWorld::discs_at_rest() const noexcept { return implementation_->table_.at_rest(); }
double SimWorld::kinetic_energy() const noexcept { return implementation_->table_.kinetic_energy(); }
Vector3 SimWorld::p_WT() const noexcept { return implementation_->arm_.X_WT().translation(); }
Vector3 SimWorld::v_WT() const noexcept { return implementation_->arm_.v_WT(); }
std::span<const std::uint64_t> SimWorld::verdicts() const noexcept { return implementation_->drives_.verdicts(); }
double SimWorld::block_force() const noexcept { return implementation_->block_force_; }
double SimWorld::peak_torque_share() const noexcept { return implementation_->arm_.peak_torque_share(); }

}  // namespace breakshot::sim_bridge
