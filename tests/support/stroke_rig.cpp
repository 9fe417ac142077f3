#include "tests/support/stroke_rig.hpp"

#include "controller/loop/control_loop.hpp"
#include "controller/loop/event_text.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

namespace breakshot::support {
namespace {

using control::LoopEvent;
using motion::Trajectory;

constexpr Time kStart = time_from_ns(1'000'000'000);
/// The loop is ready after a few ticks; a stroke settles within half a second of its last set-point.
constexpr int kMostTicksToReady = 100;
constexpr std::size_t kMostTicksAfter = 1000;
/// Way of a push before it meets its discs, m.
constexpr double kPushRunIn = 0.010;

double direction_error(const Vector2& v, const Vector2& direction) {
  return std::abs(std::atan2(direction.x() * v.y() - direction.y() * v.x(), direction.dot(v)));
}

/// One run: the loop, the world, and what comes of it.
class Run {
 public:
  Run(const StrokeRigSettings& settings, const sim_bridge::SimSettings& sim, std::vector<control::TickRecord>* ticks)
      : world_{settings.arm, sim},
        tap_{ticks != nullptr ? std::make_unique<control::FlightTap>() : nullptr},
        ticks_{ticks},
        loop_{settings.loop, *channels_, tap_.get()},
        phase_{settings.phase} {}

  sim_bridge::SimWorld& world() noexcept { return world_; }

  void tick() {
    const JointState state = world_.joint_state();
    const JointCommand command = loop_.tick(&state, world_.now() + phase_);
    if (command.q.size() != 0 && world_.command(command) != sim_bridge::CommandVerdict::kTaken)
      throw std::logic_error{"stroke rig: the drives refuse a command"};
    world_.tick();
    control::TickRecord record;
    while (tap_ && tap_->ticks.pop(record)) ticks_->push_back(record);
  }
  void get_ready() {
    for (int i = 0; i < kMostTicksToReady; ++i) {
      tick();
      if (channels_->status.latest().ready()) return;
    }
    throw std::logic_error{"stroke rig: the loop does not get ready"};
  }
  void start(const Trajectory& trajectory, control::LoopRequest::Join join = {}) {
    channels_->requests.push(
        {.kind = control::LoopRequest::Kind::kStart, .trajectory = &trajectory, .trajectory_number = ++started_, .join = join});
  }
  bool next_event(LoopEvent& event) { return channels_->events.pop(event); }

 private:
  sim_bridge::SimWorld world_;
  std::unique_ptr<control::LoopChannels> channels_ = std::make_unique<control::LoopChannels>();
  std::unique_ptr<control::FlightTap> tap_;
  std::vector<control::TickRecord>* ticks_;
  control::ControlLoop loop_;
  Duration phase_;
  std::uint64_t started_ = 0;
};

}  // namespace

StrokeRig::StrokeRig(StrokeRigSettings settings) : settings_{std::move(settings)}, kinematics_{settings_.arm, settings_.sim.X_WB} {}

AchievedStroke StrokeRig::run(const StrokeRequest& request, const Trajectory& trajectory, std::span<const SimDisc> discs,
                              std::vector<control::TickRecord>* ticks, const Before* before) const {
  const auto joints = [&](const std::array<double, kMaxJoints>& values) {
    return JointVector{JointVector::Map(values.data(), trajectory.joints)};
  };
  const auto along_tip = [&](const JointVector& q, const JointVector& qd) {
    kinematics::Jacobian J_W;
    kinematics_.tip_in_world(q, J_W);
    return (J_W.topRows<2>() * qd).dot(request.direction_W);
  };
  sim_bridge::SimSettings sim = settings_.sim;
  sim.q_start = joints((before != nullptr ? before->trajectory : trajectory).points[0].q);
  sim.start = kStart;
  Run run{settings_, sim, ticks};
  run.world().place(discs);
  run.get_ready();
  const std::size_t ticks_before = before != nullptr ? before->tick : 0;
  const auto until_begin = static_cast<std::int64_t>(ticks_before) * trajectory.tick;
  // The set-point of index k is sent k ticks from then, and the arm is to be there so much later.
  const Time begin = run.world().now() + until_begin + settings_.phase + settings_.loop.lead + settings_.loop.drive_lag;
  if (before != nullptr) {
    run.start(before->trajectory);
    run.tick();
    run.start(trajectory, {1, before->tick});
  } else {
    run.start(trajectory);
  }
  const Time contact = begin + static_cast<std::int64_t>(trajectory.contact_tick) * trajectory.tick;
  const bool push = request.kind == StrokeKind::kPush;

  AchievedStroke achieved;
  const auto look = [&](const motion::TrajectoryPoint& point, bool at_contact) {
    const JointState state = run.world().joint_state();
    achieved.tracking_error = std::max(achieved.tracking_error, (state.q - joints(point.q)).cwiseAbs().maxCoeff());
    const bool on_line = push && point.phase == StrokePhase::kRunIn;
    if (!on_line && !(at_contact && !push)) return;
    const Vector3 p_WT = run.world().p_WT();
    const Vector2 v_W = run.world().v_WT().head<2>();
    const Vector2 from_point = p_WT.head<2>() - request.p_WS;
    achieved.height_error = std::max(achieved.height_error, std::abs(p_WT.z() - settings_.tip_height));
    if (on_line) {
      achieved.line_deviation = std::max(achieved.line_deviation, std::abs(from_point.dot(perpendicular(request.direction_W))));
      if (along_tip(joints(point.q), joints(point.qd)) < (1.0 - 1e-6) * request.speed) return;  // setting off or slowing down
    } else {
      achieved.position_error = from_point.norm();
    }
    achieved.direction_error = std::max(achieved.direction_error, direction_error(v_W, request.direction_W));
    achieved.speed_error = std::max(achieved.speed_error, std::abs(v_W.norm() / request.speed - 1.0));
  };

  bool ended = false;
  for (std::size_t tick = 0; !ended && tick < ticks_before + trajectory.size + kMostTicksAfter; ++tick) {
    const Time now = run.world().now();
    if (now >= begin) {
      const auto k = static_cast<std::size_t>((now - begin) / trajectory.tick);
      if (k < trajectory.size) look(trajectory.points[k], now == contact);
    }
    run.tick();
    LoopEvent event;
    while (run.next_event(event)) {
      if (event.kind == LoopEvent::Kind::kContact && event.time >= begin)
        achieved.measured_speed = along_tip(joints(event.q), joints(event.qd));
      if (event.kind == LoopEvent::Kind::kStopped || event.kind == LoopEvent::Kind::kNotStarted)
        achieved.stopped = control::describe(event.causes);
      ended = ended || (event.kind == LoopEvent::Kind::kDone && !event.joined) || !achieved.stopped.empty();
    }
  }
  if (!ended) throw std::logic_error{"stroke rig: a stroke does not end"};

  achieved.peak_torque_share = run.world().peak_torque_share();
  for (std::size_t tick = 0; !run.world().discs_at_rest() && tick < kMostTicksAfter; ++tick) run.tick();
  const SimTruth truth = run.world().truth();
  achieved.strikes = truth.strikes;
  achieved.discs = truth.discs;
  if (const auto& strike = run.world().first_strike()) {
    achieved.touch = {.position_error = (strike->p_WS - request.p_WS).norm(),
                      .direction_error = direction_error(strike->v_WS_W, request.direction_W),
                      .speed_error = std::abs(strike->v_WS_W.norm() / request.speed - 1.0),
                      .late = to_seconds(strike->at - contact),
                      .speed = strike->v_WS_W.dot(request.direction_W)};
  }
  return achieved;
}

std::vector<SimDisc> discs_before(const StrokeRequest& request, const SimDisc& kind, double striker_radius) {
  const double reach = kind.radius + striker_radius;
  SimDisc disc = kind;
  if (request.kind == StrokeKind::kHit) {
    disc.p_WD = request.p_WS + reach * request.direction_W;
    return {disc};
  }
  const double ahead = kPushRunIn + std::sqrt(reach * reach - kind.radius * kind.radius);
  std::vector<SimDisc> discs;
  for (const double side : {-1.0, 1.0}) {
    disc.p_WD = request.p_WS + ahead * request.direction_W + side * kind.radius * perpendicular(request.direction_W);
    discs.push_back(disc);
  }
  return discs;
}

}  // namespace breakshot::support
