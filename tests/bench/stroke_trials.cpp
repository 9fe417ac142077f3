#include "tests/bench/stroke_trials.hpp"

#include "common/urdf/cell_arm.hpp"
#include "controller/controller_config.hpp"
#include "controller/motion/join.hpp"
#include "sim_bridge/sim_bridge_config.hpp"

#include <fmt/core.h>
#include <ruckig/ruckig.hpp>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace breakshot::bench {
namespace {

using motion::StrokePlanner;
using motion::Trajectory;
using motion::TrajectoryPoint;
using support::StrokeAudit;

/// Samples of a push's path for its bound.
constexpr int kPathSamples = 400;

double cpu_time() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Shortest time from one state to another when every joint moves alone: nothing that keeps the joints' limits is quicker, s.
double joint_bound(const TrajectoryPoint& from, const TrajectoryPoint& to, int joints, const JointVector& max_speed,
                   const motion::MotionSettings& settings) {
  double bound = 0.0;
  ruckig::Ruckig<1> solver;
  ruckig::Trajectory<1> trajectory;
  for (int i = 0; i < joints; ++i) {
    const auto j = static_cast<std::size_t>(i);
    ruckig::InputParameter<1> input;
    input.current_position = {from.q[j]};
    input.current_velocity = {from.qd[j]};
    input.current_acceleration = {from.qdd[j]};
    input.target_position = {to.q[j]};
    input.target_velocity = {to.qd[j]};
    input.target_acceleration = {to.qdd[j]};
    // A little more than the limits, because states at them are off by rounding.
    input.max_velocity = {1.001 * max_speed[i]};
    input.max_acceleration = {1.001 * settings.max_acceleration};
    input.max_jerk = {settings.max_jerk};
    if (solver.calculate(input, trajectory) >= 0) bound = std::max(bound, trajectory.get_duration());
  }
  return bound;
}

/// The joints' path under a push's line, from its trajectory.
JointPath path_of_push(const StrokePlanner& planner, const StrokeRequest& request, const Trajectory& trajectory) {
  const motion::TipTracker tracker{planner.kinematics()};
  const Vector3 direction{request.direction_W.x(), request.direction_W.y(), 0.0};
  JointPath path;
  path.step = request.length / kPathSamples;
  JointVector q = Eigen::Map<const Eigen::VectorXd>{trajectory.points[trajectory.contact_tick].q.data(), trajectory.joints};
  JointVector dq = JointVector::Zero(q.size());
  for (int k = 0; k <= kPathSamples; ++k) {
    const Vector2 p = request.p_WS + k * path.step * request.direction_W;
    q += path.step * dq;
    if (!tracker.follow({p.x(), p.y(), planner.settings().tip_height}, direction, {0.0, 0.0, -1.0}, q, dq)) return {};
    path.q.push_back(q);
    path.dq.push_back(dq);
  }
  for (std::size_t k = 0; k < path.dq.size(); ++k) {
    const std::size_t a = k == 0 ? 0 : k - 1;
    const std::size_t b = std::min(k + 1, path.dq.size() - 1);
    path.ddq.emplace_back((path.dq[b] - path.dq[a]) / (static_cast<double>(b - a) * path.step));
  }
  return path;
}

/// Limits that a stroke breaks; empty: none.
std::string broken_limits(const StrokeAudit& found, const StrokeRequest& request, const motion::MotionSettings& settings, bool starts_low) {
  std::string broken;
  const auto check = [&](bool holds, const char* what, double value) {
    if (!holds) broken += fmt::format("{} {:.6g}; ", what, value);
  };
  check(found.range <= 1e-6, "rad out of range", found.range);
  check(found.speed <= 1.001, "of the speed limit", found.speed);
  check(found.acceleration <= 1.001, "of the acceleration limit", found.acceleration);
  check(found.jerk <= 1.01, "of the jerk limit", found.jerk);
  check(found.at_rest_at_ends, "moves at its ends", 0.0);
  check(found.lowest_link >= settings.link_clearance - 1e-4, "m lowest link", found.lowest_link);
  if (request.kind == StrokeKind::kPark) return broken;
  check(found.lowest_tip >= settings.tip_height - 1e-4, "m lowest tip", found.lowest_tip);
  // A start below the safe height is left straight up, wherever that is.
  check(starts_low || found.low_outside_dip <= 0.2 * settings.clearance, "m low outside of the dip", found.low_outside_dip);
  return broken;
}

/// Plans, measures and runs strokes one after another.
class Sequence {
 public:
  Sequence(const TrialSetup& setup, TrialScope scope)
      : setup_{setup}, scope_{scope}, planner_{setup.rig.arm, setup.rig.sim.X_WB, setup.motion}, rig_{setup.rig}, q_{setup.motion.park} {}

  Trial run(StrokeRequest request, SplitMix64& random) {
    request.park_after = random.uniform() < 0.5;
    Trial trial;
    trial.request = request;
    if (request.kind != StrokeKind::kPark) trial.speed_bound = planner_.speed_bound(request.p_WS, request.direction_W);
    const double start = cpu_time();
    const auto times = planner_.plan(request, q_, *trajectory_);
    trial.plan_ms = 1e3 * (cpu_time() - start);
    if (!times) {
      trial.refusal = times.error();
      return trial;
    }
    trial.times = *times;
    trial.planned = support::audit(planner_, request, *times, *trajectory_);
    const bool starts_low = planner_.clearance().heights(q_).tip < setup_.motion.safe_height();
    trial.broken = broken_limits(trial.planned, request, setup_.motion, starts_low);
    if (before_total_ > Duration::zero() && request.kind != StrokeKind::kPark) join(trial);
    if (scope_.bounds && request.kind != StrokeKind::kPark) hold_against_bounds(trial);
    if (scope_.achieved && request.kind != StrokeKind::kPark) {
      trial.alone = rig_.run(request, *trajectory_, {});
      trial.with_discs = rig_.run(request, *trajectory_, support::discs_before(request, setup_.disc, setup_.motion.striker_radius));
    }
    const TrajectoryPoint& last = trajectory_->points[trajectory_->size - 1];
    q_ = Eigen::Map<const Eigen::VectorXd>{last.q.data(), trajectory_->joints};
    std::swap(trajectory_, before_);
    before_total_ = request.kind == StrokeKind::kPark ? Duration::zero() : times->total;
    return trial;
  }

 private:
  /// Plans the stroke out of the one before it.
  void join(Trial& trial) {
    trial.follows = true;
    const support::Before before{*before_, motion::first_join(*before_)};
    const auto times = planner_.plan(trial.request, motion::state_at(*before_, before.tick), *joined_);
    if (!times) return;
    const Duration both = static_cast<std::int64_t>(before.tick) * joined_->tick + times->total;
    trial.over_separate = to_seconds(both) / to_seconds(before_total_ + trial.times.total);
    const std::string broken =
        broken_limits(support::audit(planner_, trial.request, *times, *joined_, &before), trial.request, setup_.motion, false);
    if (!broken.empty()) trial.broken += "joined: " + broken;
  }

  void hold_against_bounds(Trial& trial) const {
    const bool push = trial.request.kind == StrokeKind::kPush;
    const Trajectory& t = *trajectory_;
    std::size_t line_end = t.contact_tick;
    while (push && t.points[line_end].phase == StrokePhase::kRunIn) ++line_end;
    const JointVector& max_speed = planner_.kinematics().max_speed();
    const auto bound = [&](std::size_t from, std::size_t to) {
      return joint_bound(t.points[from], t.points[to], t.joints, max_speed, setup_.motion);
    };
    const double moved = to_seconds(t.tick) * static_cast<double>(t.contact_tick + t.size - 1 - line_end);
    trial.over_bound = moved / (bound(0, t.contact_tick) + bound(line_end, t.size - 1));
    if (!push) return;
    PushPath found{path_of_push(planner_, trial.request, t), to_seconds(t.tick) * static_cast<double>(line_end - t.contact_tick), 0.0};
    if (!found.path.dq.empty()) found.least = least_path_time(found.path, max_speed, setup_.motion.max_acceleration, trial.request.speed);
    trial.push = std::move(found);
  }

  const TrialSetup& setup_;
  TrialScope scope_;
  StrokePlanner planner_;
  support::StrokeRig rig_;
  JointVector q_;  ///< where the next stroke begins: where the last one ended
  std::unique_ptr<Trajectory> trajectory_ = std::make_unique<Trajectory>();
  std::unique_ptr<Trajectory> before_ = std::make_unique<Trajectory>();  ///< of the last accepted stroke
  Duration before_total_{};                                              ///< of it; 0: none that may be taken over from
  std::unique_ptr<Trajectory> joined_ = std::make_unique<Trajectory>();
};

}  // namespace

TrialSetup load_trial_setup(const std::string& config_file, const std::vector<std::string>& overrides) {
  const ConfigDocument document = load_cell_document(config_file, overrides);
  TrialSetup setup;
  setup.cell = load_cell_config(document);
  const auto controller = control::load_controller_config(document, setup.cell);
  const auto bridge = sim_bridge::load_sim_bridge_config(document, setup.cell);
  setup.motion = controller.motion;
  setup.rig.arm = load_cell_arm(setup.cell);
  setup.rig.sim = bridge.sim;
  setup.rig.loop = controller.loop;
  setup.rig.loop.limits = control::joint_limits(setup.rig.arm, controller.loop.stop);
  setup.rig.tip_height = setup.motion.tip_height;
  setup.disc.radius = bridge.disc_mass_radius;
  setup.disc.height = setup.cell.disc_height;
  setup.disc.mass = bridge.disc_mass;
  return setup;
}

std::vector<Trial> run_trials(const TrialSetup& setup, const RequestSource& source, int n, std::uint64_t seed, TrialScope scope,
                              int threads) {
  const int sequences = (n + kSequence - 1) / kSequence;
  std::vector<std::uint64_t> seeds;
  SplitMix64 random{seed};
  for (int i = 0; i < sequences; ++i) seeds.push_back(random.next());

  std::vector<Trial> trials(static_cast<std::size_t>(n));
  std::atomic<int> next{0};
  std::exception_ptr failed;
  std::mutex failing;
  const auto work = [&] {
    try {
      for (int i = next++; i < sequences; i = next++) {
        Sequence sequence{setup, scope};
        SplitMix64 own{seeds[static_cast<std::size_t>(i)]};
        for (int k = i * kSequence; k < std::min(n, (i + 1) * kSequence); ++k) {
          const StrokeRequest request = source(own);
          trials[static_cast<std::size_t>(k)] = sequence.run(request, own);
        }
      }
    } catch (...) {
      const std::lock_guard lock{failing};
      failed = std::current_exception();
      next = sequences;
    }
  };
  std::vector<std::jthread> workers;
  for (int i = 1; i < threads; ++i) workers.emplace_back(work);
  work();
  workers.clear();
  if (failed) std::rethrow_exception(failed);
  return trials;
}

}  // namespace breakshot::bench
