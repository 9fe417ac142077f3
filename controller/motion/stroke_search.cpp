#include "controller/motion/stroke_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace breakshot::motion {
namespace {

/// Distance in time of the samples on which the search decides, s.
constexpr double kDipStep = 0.006;
constexpr double kTransitStep = 0.010;
/// Longest that a hit may take from the safe height to the contact, s.
constexpr double kLongestApproach = 2.0;
/// Most samples of a dip on one side of time 0; long pushes are slow, so their samples stay a few millimetres apart.
constexpr int kMostSamples = 120;
/// How much lower than allowed a transit may seem between its samples before it counts as too low, m. A tenth of the clearance.
constexpr double kHeightTolerance = 0.001;

/// Tip speeds at which a hit's tip leaves the safe height, relative to the speed at contact. At 1 all of the acceleration is the transit's;
/// at 0 the tip comes straight down and all of it is the run-in's, which takes least room.
constexpr std::array kEntrySpeeds{1.0, 0.6, 0.3, 0.0};
/// Shares of the joints' acceleration and jerk that the vertical motion of a dip may take, most first: the less, the longer the striker is low, but
/// the more is left for what the line itself asks of the joints.
constexpr std::array kClimbShares{0.9, 0.65, 0.45, 0.3, 0.2, 0.12};
constexpr std::array kMoreClimbShares{0.9, 0.65, 0.45, 0.3, 0.2, 0.12, 0.07, 0.04};
/// Accelerations along the line at a hit's contact, as shares of the least and the most that the joints allow there: through it at constant speed
/// when they can, or speeding up, or slowing down.
struct AlongShare {
  double of_least, of_most;
};
constexpr std::array<AlongShare, 4> kAlongShares{{{0.0, 0.0}, {0.0, 0.6}, {0.6, 0.0}, {0.5, 0.5}}};
constexpr std::array<AlongShare, 10> kMoreAlongShares{
    {{0.0, 0.0}, {0.0, 0.6}, {0.6, 0.0}, {0.5, 0.5}, {0.0, 0.3}, {0.0, 0.85}, {0.3, 0.0}, {0.85, 0.0}, {0.7, 0.3}, {0.3, 0.7}}};
constexpr std::array kJerkShares{1.0};
constexpr std::array kMoreJerkShares{1.0, 0.5};

/// No tip accelerates more, m/s^2: stands for "no limit".
constexpr double kMostAcceleration = 50.0;
/// Least acceleration along the line that is worth a try, m/s^2.
constexpr double kLeastAcceleration = 0.3;
/// What a metre of low corridor counts for in time, s/m. Past the contact: discs that are met twice cost strokes. Before the run-in, beyond
/// MotionSettings::descent: whoever asks keeps no more than that free of other discs.
constexpr double kFollowThroughCost = 5.0;
constexpr double kDescentCost = 10.0;
/// Rolls of the striker that are tried when the last joint does not turn about the rod.
constexpr int kRolls = 8;

/// Largest tip acceleration along a direction, by the joint speeds that go with unit tip speed there.
double tip_limit(const JointVector& joint_per_tip, double joint_limit) noexcept {
  return joint_limit / std::max(joint_per_tip.cwiseAbs().maxCoeff(), 1e-9);
}

/// Shortest time in which a joint that starts (or ends) at rest can go this way, however it ends (or starts), s.
double least_time(double way, double speed, double acceleration) noexcept {
  const double to_speed = 0.5 * speed * speed / acceleration;
  return way < to_speed ? std::sqrt(2.0 * way / acceleration) : speed / acceleration + (way - to_speed) / speed;
}

Pose striker_pose(const Vector3& p_WT, double roll) {
  Pose X_WT{Eigen::Translation3d{p_WT}};
  X_WT.rotate(Eigen::AngleAxisd{roll, Vector3::UnitZ()});
  X_WT.rotate(Eigen::AngleAxisd{std::numbers::pi, Vector3::UnitX()});  // z down
  return X_WT;
}

/// Smallest t with run_up.position(t) >= way; infinity when it never gets there.
double time_to_way(const SpeedRamp& run_up, double way) noexcept {
  double high = 0.01;
  while (run_up.position(high) < way) {
    high *= 2.0;
    if (high > 10.0) return std::numeric_limits<double>::infinity();
  }
  double low = 0.0;
  for (int i = 0; i < 40; ++i) (run_up.position(0.5 * (low + high)) < way ? low : high) = 0.5 * (low + high);
  return high;
}

}  // namespace

/// Shapes of the dip that a search tries.
struct StrokeSearch::Variety {
  std::span<const double> climb_shares;
  std::span<const AlongShare> along_shares;
  std::span<const double> jerk_shares;  ///< of a run-up's jerk, as long as none is found
  /// How often the acceleration along the line is cut, and to what, when a dip asks too much of the joints.
  int cuts;
  double cut;
};

namespace {

constexpr StrokeSearch::Variety kUsual{kClimbShares, kAlongShares, kJerkShares, 3, 0.6};
/// For a stroke that is near to what the arm can do, when none of the usual shapes will do: some times the work.
constexpr StrokeSearch::Variety kThorough{kMoreClimbShares, kMoreAlongShares, kMoreJerkShares, 6, 0.75};

}  // namespace

StrokeSearch::StrokeSearch(const kinematics::ArmKinematics& arm, const kinematics::InverseKinematics& ik, const ArmClearance& clearance,
                           const MotionSettings& settings)
    : arm_{&arm},
      ik_{&ik},
      clearance_{&clearance},
      settings_{&settings},
      tracker_{arm},
      limits_{arm.lower(), arm.upper(), arm.max_speed(), settings.max_acceleration, settings.max_jerk},
      transit_{limits_, to_seconds(settings.tick)},
      tick_{to_seconds(settings.tick)} {}

kinematics::IkSolutions StrokeSearch::branches(const Vector2& p_WS, const JointVector& near) const noexcept {
  const Vector3 p_WT{p_WS.x(), p_WS.y(), settings_->tip_height};
  kinematics::IkSolutions all = ik_->solve(striker_pose(p_WT, 0.0), near);
  const Eigen::Index last = near.size() - 1;
  const bool last_turns_about_rod = !all.empty() && [&] {
    kinematics::Jacobian J_W;
    const Pose X_WT = arm_->tip_in_world(all.q[0], J_W);
    return J_W.col(last).head<3>().norm() < 1e-9 && J_W.col(last).tail<3>().cross(X_WT.linear().col(2)).norm() < 1e-9;
  }();
  if (last_turns_about_rod) {
    // Every roll is the same stroke: leave the joint where it is.
    for (std::size_t i = 0; i < all.size; ++i) all.q[i][last] = near[last];
    return all;
  }
  for (int r = 1; r < kRolls; ++r) {
    const kinematics::IkSolutions more = ik_->solve(striker_pose(p_WT, 2.0 * std::numbers::pi * r / kRolls), near);
    for (const JointVector& q : more) {
      if (all.size < kinematics::IkSolutions::kCapacity) all.q[all.size++] = q;
    }
  }
  return all;
}

double StrokeSearch::speed_bound(const Vector2& p_WS, const Vector2& direction_W) const noexcept {
  constexpr int kHalvings = 20;
  const Vector3 v_WT_W{direction_W.x(), direction_W.y(), 0.0};
  double bound = 0.0;
  for (const JointVector& q : branches(p_WS, settings_->park)) {
    const JointVector zero = JointVector::Zero(q.size());
    const JointVector bend_at_1 = bend(q, v_WT_W);
    Branch branch{q, tracker_.joint_speed(q, v_WT_W), zero, zero};
    double high = (limits_.speed.array() / branch.per_way.array().abs().max(1e-9)).minCoeff();
    // Passing straight through takes joint accelerations that grow with the speed's square; speeding up or slowing down on the line may help.
    const auto stands = [&](double speed) {
      branch.bend = speed * speed * bend_at_1;
      const auto [least, most] = line_acceleration(branch, 0.0, 1.0);
      return least <= most;
    };
    if (!stands(high)) {
      double low = 0.0;
      for (int i = 0; i < kHalvings; ++i) (stands(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
    }
    bound = std::max(bound, high);
  }
  return bound;
}

int StrokeSearch::first_tick(const Dip& dip) const noexcept { return static_cast<int>(std::floor(dip.begin / tick_)); }
int StrokeSearch::last_tick(const Dip& dip) const noexcept { return static_cast<int>(std::ceil(dip.end / tick_)); }

bool StrokeSearch::in_area(const Dip& dip, double t) const noexcept {
  return settings_->striker_area.contains(dip.p_WS + dip.way(t) * dip.direction_W);
}

std::optional<StrokeWay> StrokeSearch::find(const StrokeRequest& request, const MotionState& begin, double share, bool first_found) {
  stage_ = SearchStage::kReach;
  best_.reset();
  best_cost_ = std::numeric_limits<double>::infinity();
  StrokeWay start;
  MotionState from = begin;
  const bool low = clearance_->heights(begin.q).tip < settings_->safe_height() - kHeightTolerance;
  if (low && (!begin.rests() || !find_lift(begin.q, share, start, from))) {
    reached(SearchStage::kTransit);
    return std::nullopt;
  }
  if (request.kind == StrokeKind::kPark) {
    reached(SearchStage::kTransit);
    if (!transit_.plan(from, MotionState::at_rest(settings_->park)) || !transit_is_clear()) return std::nullopt;
    start.q_end = settings_->park;
    start.duration += transit_.duration();
    return start;
  }
  for (const Variety* variety : {&kUsual, &kThorough}) {
    variety_ = variety;
    try_branches(request, begin.q, share, first_found, start, from);
    if (best_ || stage_ < SearchStage::kLimits) break;
  }
  return best_;
}

void StrokeSearch::try_branches(const StrokeRequest& request, const JointVector& q_start, double share, bool first_found,
                                const StrokeWay& start, const MotionState& from) {
  const Vector3 direction_W{request.direction_W.x(), request.direction_W.y(), 0.0};
  for (const JointVector& q : branches(request.p_WS, q_start)) {
    if (clearance_->heights(q).links < settings_->link_clearance) continue;
    const Branch branch{q, tracker_.joint_speed(q, direction_W), tracker_.joint_speed(q, Vector3::UnitZ()),
                        bend(q, request.speed * direction_W)};
    reached(SearchStage::kSpeed);
    if (((request.speed * branch.per_way).cwiseAbs().array() > limits_.speed.array()).any()) continue;
    reached(SearchStage::kArea);
    if (least_duration(from.q, q, from.rests()) + least_duration(q, settings_->park, true) >= best_cost_) continue;
    if (request.kind == StrokeKind::kHit) {
      try_hit(request, branch, share, start, from);
    } else {
      try_push(request, branch, share, start, from);
    }
    if (best_ && first_found) break;
  }
}

bool StrokeSearch::find_lift(const JointVector& q_start, double share, StrokeWay& way, MotionState& from) {
  const Pose X_WT = arm_->tip_in_world(q_start);
  Dip lift;
  lift.p_WS = X_WT.translation().head<2>();
  lift.axis_W = X_WT.linear().col(2);
  lift.low = X_WT.translation().z();
  const double height = settings_->safe_height() - clearance_->heights(q_start).tip;
  const JointVector per_climb = tracker_.joint_speed(q_start, Vector3::UnitZ());
  for (const double climb_share : kClimbShares) {
    const double part = climb_share * share;
    lift.rise = Rise{tip_limit(per_climb, part * limits_.acceleration), tip_limit(per_climb, part * limits_.jerk), false};
    lift.end = lift.rise.time_to(height);
    const DipUse use = use_of(lift, tracker_, limits_, q_start, lift.end, kDipStep);
    if (!use.admissible()) continue;
    way.lift = lift;
    way.q_lift = q_start;
    way.duration = last_tick(lift) * tick_;
    from = use.end;
    return true;
  }
  return false;
}

double StrokeSearch::least_duration(const JointVector& a, const JointVector& b, bool one_rests) const noexcept {
  double least = 0.0;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    const double way = std::abs(a[i] - b[i]);
    least = std::max(least, one_rests ? least_time(way, limits_.speed[i], limits_.acceleration) : way / limits_.speed[i]);
  }
  return least;
}

JointVector StrokeSearch::bend(const JointVector& q, const Vector3& v_WT_W) const noexcept {
  constexpr double kStep = 1e-3;  // s; the change over 2 ms is far above rounding and far below what bends again
  const JointVector ahead = tracker_.joint_speed(q + kStep * tracker_.joint_speed(q, v_WT_W), v_WT_W);
  const JointVector behind = tracker_.joint_speed(q - kStep * tracker_.joint_speed(q, v_WT_W), v_WT_W);
  return (ahead - behind) / (2.0 * kStep);
}

std::pair<double, double> StrokeSearch::line_acceleration(const Branch& branch, double climb, double share) const noexcept {
  // Every joint: |bend + climb * per_climb + a * per_way| <= limit.
  double least = -kMostAcceleration;
  double most = kMostAcceleration;
  for (Eigen::Index i = 0; i < branch.q.size(); ++i) {
    const double limit = share * limits_.acceleration;
    const double taken = branch.bend[i] + climb * branch.per_climb[i];
    const double per = branch.per_way[i];
    if (std::abs(per) < 1e-9) {
      if (std::abs(taken) > limit) most = -std::numeric_limits<double>::infinity();
      continue;
    }
    const double a = (-limit - taken) / per;
    const double b = (limit - taken) / per;
    least = std::max(least, std::min(a, b));
    most = std::min(most, std::max(a, b));
  }
  return {least, most};
}

std::optional<StrokeSearch::Side> StrokeSearch::approach(const StrokeRequest& request, const Branch& branch, const TipAcceleration& a,
                                                         double share, const MotionState& from) {
  std::optional<Side> best;
  for (const double jerk_share : variety_->jerk_shares) {
    if (!best) best = approach(request, branch, a, share, jerk_share, from);
  }
  return best;
}

std::optional<StrokeSearch::Side> StrokeSearch::approach(const StrokeRequest& request, const Branch& branch, const TipAcceleration& a,
                                                         double share, double jerk_share, const MotionState& from) {
  const double jerk_ratio = jerk_share * limits_.jerk / limits_.acceleration;
  const double height = settings_->safe_height() - settings_->tip_height;
  const double over_low = settings_->disc_height - settings_->tip_height;
  const double most = line_acceleration(branch, a.climb, share).second;
  std::optional<Side> best;
  Side side;
  side.dip.p_WS = request.p_WS;
  side.dip.direction_W = request.direction_W;
  side.dip.low = settings_->tip_height;
  Dip& dip = side.dip;
  for (const double entry : kEntrySpeeds) {
    const bool constant = entry == 1.0;
    if (constant && a.along > 0.0) continue;
    double acceleration = std::max(std::abs(a.along), most);
    for (int cut = 0; cut <= variety_->cuts; ++cut, acceleration = std::max(std::abs(a.along), variety_->cut * acceleration)) {
      if (constant && a.along == 0.0) {
        dip.run_up = SpeedRamp{request.speed};
      } else {
        if (acceleration < kLeastAcceleration) break;
        // Backward in time: what was a gain is a loss. Constant: on and on with the acceleration that the contact has.
        const double far = constant ? request.speed - a.along * kLongestApproach : entry * request.speed;
        dip.run_up = SpeedRamp{request.speed, -a.along, far, constant ? std::abs(a.along) : acceleration, jerk_ratio * acceleration};
      }
      const double run_in_time = time_to_way(dip.run_up, request.run_in);
      dip.fall = Rise{a.climb, jerk_ratio * a.climb, true};
      dip.level = 0.0;
      if (dip.fall.time_to(settings_->run_in_band) < run_in_time) {
        // The swoop alone is too short: a level run-in, before which the vertical acceleration must end.
        dip.fall = Rise{a.climb, jerk_ratio * a.climb, false};
        dip.level = std::max(0.0, run_in_time - dip.fall.time_to(settings_->run_in_band));
      }
      dip.begin = -(dip.level + dip.fall.time_to(height));
      const bool last = constant || acceleration == std::abs(a.along);
      DipUse use;
      if (dip.begin > -kLongestApproach && in_area(dip, dip.begin)) {
        reached(SearchStage::kLimits);
        use = use_of(dip, tracker_, limits_, branch.q, dip.begin, kDipStep);
      }
      if (!use.admissible()) {
        if (last) break;
        continue;
      }
      reached(SearchStage::kTransit);
      if (transit_.plan(from, use.end)) {
        side.joint = use.end;
        side.time = transit_.duration() - dip.begin;
        const double low = -dip.way(-(dip.level + dip.fall.time_to(over_low)));
        side.cost = side.time + kDescentCost * std::max(0.0, low - request.run_in - settings_->descent);
        if ((!best || side.cost < best->cost) && side.cost < best_cost_ && transit_is_clear()) best = side;
      }
      break;
    }
  }
  return best;
}

std::optional<StrokeSearch::Side> StrokeSearch::leave(const StrokeRequest& request, const Branch& branch, const TipAcceleration& a,
                                                      double share, bool level) {
  const double jerk_ratio = limits_.jerk / limits_.acceleration;
  const double over_low = settings_->disc_height - settings_->tip_height;
  const double least = line_acceleration(branch, a.climb, share).first;
  std::optional<Side> best;
  Side side;
  side.dip.p_WS = request.p_WS;
  side.dip.direction_W = request.direction_W;
  side.dip.low = settings_->tip_height;
  Dip& dip = side.dip;
  dip.run_up = SpeedRamp{request.speed};  // for the speed at time 0
  dip.rise = Rise{a.climb, jerk_ratio * a.climb, !level};
  dip.end = dip.rise.time_to(settings_->safe_height() - settings_->tip_height);
  for (const bool brakes : {true, false}) {
    double acceleration = std::max(std::abs(a.along), -least);
    for (int cut = 0; cut <= variety_->cuts; ++cut, acceleration = std::max(std::abs(a.along), variety_->cut * acceleration)) {
      if (brakes || a.along > 0.0) {
        if (acceleration < kLeastAcceleration) break;
        // Not braking means no more than letting go of the acceleration.
        const double after = brakes ? 0.0 : request.speed + 0.5 * a.along * a.along / (jerk_ratio * acceleration);
        dip.brake = SpeedRamp{request.speed, a.along, after, acceleration, jerk_ratio * acceleration};
      } else if (a.along < 0.0) {
        dip.brake = SpeedRamp{request.speed, a.along, 0.0, -a.along, jerk_ratio * acceleration};
      } else {
        dip.brake = SpeedRamp{request.speed};
      }
      const bool last = !brakes || acceleration == std::abs(a.along);
      DipUse use;
      if (in_area(dip, dip.end)) use = use_of(dip, tracker_, limits_, branch.q, dip.end, kDipStep);
      if (!use.admissible()) {
        if (last) break;
        continue;
      }
      if (transit_.plan(use.end, MotionState::at_rest(end_pose(request, use.end)))) {
        side.joint = use.end;
        side.time = dip.end + transit_.duration();
        side.cost = side.time + kFollowThroughCost * dip.way(dip.rise.time_to(over_low));
        if ((!best || side.cost < best->cost) && transit_is_clear()) best = side;
      }
      break;
    }
  }
  return best;
}

void StrokeSearch::try_hit(const StrokeRequest& request, const Branch& branch, double share, const StrokeWay& start,
                           const MotionState& from) {
  // A hit that passes the contact at constant speed meets a disc that stands a little elsewhere as fast: where one is possible, no other will do.
  bool steady = false;
  for (const double climb_share : variety_->climb_shares) {
    const double climb = tip_limit(branch.per_climb, climb_share * share * limits_.acceleration);
    const auto [least, most] = line_acceleration(branch, climb, share);
    if (least > most) continue;
    bool found = false;
    bool better = false;
    for (const AlongShare& part : variety_->along_shares) {
      const double along = part.of_least * least + part.of_most * most;
      if (along < least || along > most || (steady && along != 0.0)) continue;
      const TipAcceleration a{climb, along};
      const auto before = approach(request, branch, a, share, from);
      if (!before) continue;
      const auto after = leave(request, branch, a, share, !before->dip.fall.starts_accelerated());
      if (!after) continue;
      found = true;
      steady = steady || along == 0.0;
      if (before->cost + after->cost >= best_cost_) break;
      better = true;
      best_cost_ = before->cost + after->cost;
      best_ = start;
      best_->q_dip = branch.q;
      best_->dip = before->dip;
      best_->dip->rise = after->dip.rise;
      best_->dip->brake = after->dip.brake;
      best_->dip->end = after->dip.end;
      best_->q_end = end_pose(request, after->joint);
      best_->duration += before->time + after->time;
      break;
    }
    if (found && !better) return;  // less climb and more braking pays as long as it does
  }
}

void StrokeSearch::try_push(const StrokeRequest& request, const Branch& branch, double share, const StrokeWay& start,
                            const MotionState& from) {
  const double jerk_ratio = limits_.jerk / limits_.acceleration;
  const double height = settings_->safe_height() - settings_->tip_height;
  reached(SearchStage::kLimits);
  for (const double climb_share : variety_->climb_shares) {
    const double part = climb_share * share;
    const double climb = tip_limit(branch.per_climb, part * limits_.acceleration);
    const double acceleration = tip_limit(branch.per_way, part * limits_.acceleration);
    Dip dip;
    dip.p_WS = request.p_WS;
    dip.direction_W = request.direction_W;
    dip.low = settings_->tip_height;
    dip.fall = Rise{climb, jerk_ratio * climb, false};
    dip.rise = dip.fall;
    dip.begin = -dip.fall.time_to(height);
    dip.set_off = SpeedRamp{0.0, 0.0, request.speed, acceleration, jerk_ratio * acceleration};
    dip.slow_down = SpeedRamp{request.speed, 0.0, 0.0, acceleration, jerk_ratio * acceleration};
    const double cruise = request.length - dip.set_off.length() - dip.slow_down.length();
    if (cruise < 0.0) return;  // too short to reach the speed, and with less acceleration all the more
    dip.cruise = cruise / request.speed;
    dip.end = dip.line_time() + dip.rise.time_to(height);
    const DipUse down = use_of(dip, tracker_, limits_, branch.q, dip.begin, kDipStep);
    if (!down.admissible()) continue;
    const DipUse up = use_of(dip, tracker_, limits_, branch.q, dip.end, std::max(kDipStep, dip.end / kMostSamples));
    if (!up.admissible()) continue;

    reached(SearchStage::kTransit);
    if (!transit_.plan(from, down.end)) continue;
    double duration = start.duration + transit_.duration() + dip.end - dip.begin;
    if (duration >= best_cost_) return;
    if (!transit_is_clear()) continue;
    const JointVector q_end = end_pose(request, up.end);
    if (!transit_.plan(up.end, MotionState::at_rest(q_end))) continue;
    duration += transit_.duration();
    if (duration >= best_cost_) return;
    if (!transit_is_clear()) continue;
    best_cost_ = duration;
    best_ = start;
    best_->q_dip = branch.q;
    best_->dip = dip;
    best_->q_end = q_end;
    best_->duration = duration;
    return;
  }
}

JointVector StrokeSearch::end_pose(const StrokeRequest& request, const MotionState& leaving) const {
  if (request.park_after) return settings_->park;
  // Come to rest over the place, a little higher.
  constexpr double kStep = 0.01;
  constexpr int kSteps = 10;
  JointVector q_end = leaving.q;
  JointVector qd = leaving.qd;
  Vector3 p_WT = arm_->tip_in_world(leaving.q).translation();
  for (int i = 0; i < kSteps; ++i) {
    p_WT.z() += kStep;
    JointVector q = q_end;
    if (!tracker_.follow(p_WT, Vector3::Zero(), {0.0, 0.0, -1.0}, q, qd) || !arm_->within_limits(q)) break;
    q_end = q;
  }
  return q_end;
}

bool StrokeSearch::transit_is_clear() {
  MotionState state;
  const int n = std::max(1, static_cast<int>(std::ceil(transit_.duration() / kTransitStep)));
  for (int k = 0; k <= n; ++k) {
    transit_.at(transit_.duration() * k / n, state);
    if (!arm_->within_limits(state.q)) return false;
    const ArmClearance::Heights heights = clearance_->heights(state.q);
    if (heights.tip < settings_->safe_height() - kHeightTolerance || heights.links < settings_->link_clearance) return false;
  }
  return true;
}

}  // namespace breakshot::motion
