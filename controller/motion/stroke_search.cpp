#include "controller/motion/stroke_search.hpp"

#include "controller/motion/stroke_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

// StrokeSearch from a request to the branches worth a try, and its transits. The dips of a branch are in stroke_shapes.cpp.

namespace breakshot::motion {
namespace {

/// Distance in time of a transit's samples on which the search decides, s.
constexpr double kTransitStep = 0.010;
/// How much lower than allowed a transit may seem between its samples before it counts as too low, m. A tenth of the clearance.
constexpr double kHeightTolerance = 0.001;

/// Rolls of the striker that are tried when the last joint does not turn about the rod.
constexpr int kRolls = 8;

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
