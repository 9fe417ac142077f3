#include "controller/motion/stroke_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace breakshot::motion {
namespace {

/// Distance in time of the samples on which the search decides, s.
constexpr double kDipStep = 0.004;
constexpr double kTransitStep = 0.010;
/// Most samples of a dip on one side of time 0; long pushes are slow, so their samples stay a few millimetres apart.
constexpr int kMostSamples = 120;
/// How much lower than allowed a transit may seem between its samples before it counts as too low, m. A tenth of the clearance.
constexpr double kHeightTolerance = 0.001;

/// Shares of the joints' acceleration and jerk for the vertical and the horizontal motion of a dip. With nothing for the horizontal one the speed
/// is constant while the tip is low and all the rest happens in the transits.
struct Shares {
  double vertical, horizontal;
};
constexpr std::array kShares{Shares{0.9, 0.0}, Shares{0.5, 0.45}};
/// What is tried of them, most first.
constexpr std::array kScales{1.0, 0.75, 0.55, 0.4, 0.25, 0.12};
/// Tip speed where the tip leaves the safe height, by the speed at contact.
constexpr std::array kEntrySpeeds{0.5, 0.0};
/// Rolls of the striker that are tried when the last joint does not turn about the rod.
constexpr int kRolls = 8;

/// Largest tip acceleration along a direction, by the joint speeds that go with unit tip speed there.
double tip_limit(const JointVector& joint_per_tip, double joint_limit) noexcept {
  return joint_limit / std::max(joint_per_tip.cwiseAbs().maxCoeff(), 1e-9);
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
  double bound = 0.0;
  for (const JointVector& q : branches(p_WS, settings_->park)) {
    const JointVector per_tip = tracker_.joint_speed(q, {direction_W.x(), direction_W.y(), 0.0});
    bound = std::max(bound, (limits_.speed.array() / per_tip.array().abs().max(1e-9)).minCoeff());
  }
  return bound;
}

int StrokeSearch::first_tick(const Dip& dip) const noexcept { return static_cast<int>(std::floor(dip.begin / tick_)); }
int StrokeSearch::last_tick(const Dip& dip) const noexcept { return static_cast<int>(std::ceil(dip.end / tick_)); }

bool StrokeSearch::sample(const Dip& dip, const JointVector& q0, int first, int last, std::vector<MotionState>& states) const {
  // One tick more at either end, from which the acceleration at the ends follows.
  const auto at = [&](int k) -> MotionState& { return states[static_cast<std::size_t>(k - first + 1)]; };
  states.resize(static_cast<std::size_t>(last - first + 3));
  for (const int direction : {-1, 1}) {
    JointVector q = q0;
    for (int k = direction < 0 ? 0 : 1; direction < 0 ? k >= first - 1 : k <= last + 1; k += direction) {
      const Dip::Tip tip = dip.at(k * tick_);
      if (!tracker_.follow(tip.p_WT, dip.axis_W, q)) return false;
      if (k <= last + 1 && k >= first - 1) at(k) = {q, tracker_.joint_speed(q, tip.v_WT_W), JointVector::Zero(q.size())};
    }
  }
  for (int k = first; k <= last; ++k) at(k).qdd = (at(k + 1).qd - at(k - 1).qd) / (2.0 * tick_);
  states.erase(states.begin());
  states.pop_back();
  return true;
}

bool StrokeSearch::in_area(const Dip& dip, double from, double to) const noexcept {
  return settings_->striker_area.contains(dip.p_WS + dip.way(from) * dip.direction_W) &&
         settings_->striker_area.contains(dip.p_WS + dip.way(to) * dip.direction_W);
}

std::optional<StrokeWay> StrokeSearch::find(const StrokeRequest& request, const JointVector& q_start, double share, bool first_found) {
  stage_ = SearchStage::kReach;
  best_.reset();
  StrokeWay start;
  MotionState from = MotionState::at_rest(q_start);
  if (clearance_->heights(q_start).tip < settings_->safe_height() - kHeightTolerance && !find_lift(q_start, share, start, from)) {
    reached(SearchStage::kTransit);
    return std::nullopt;
  }
  if (request.kind == StrokeKind::kPark) {
    start.q_end = settings_->park;
    try_transits(request, start, from);
    return best_;
  }
  for (const JointVector& q : branches(request.p_WS, q_start)) {
    if (clearance_->heights(q).links < settings_->link_clearance) continue;
    if (request.kind == StrokeKind::kHit) {
      try_hit(request, q, share, start, from);
    } else {
      try_push(request, q, share, start, from);
    }
    if (best_ && first_found) break;
  }
  return best_;
}

bool StrokeSearch::find_lift(const JointVector& q_start, double share, StrokeWay& way, MotionState& from) {
  const Pose X_WT = arm_->tip_in_world(q_start);
  Dip lift;
  lift.p_WS = X_WT.translation().head<2>();
  lift.axis_W = X_WT.linear().col(2);
  lift.low = X_WT.translation().z();
  const double height = settings_->safe_height() + (lift.low - clearance_->heights(q_start).tip) - lift.low;
  const JointVector per_climb = tracker_.joint_speed(q_start, Vector3::UnitZ());
  for (const double scale : kScales) {
    const double part = 0.9 * share * scale;
    lift.rise = Rise{tip_limit(per_climb, part * limits_.acceleration), tip_limit(per_climb, part * limits_.jerk), false};
    lift.end = lift.rise.time_to(height);
    if (!use_of(lift, tracker_, limits_, q_start, lift.end, kDipStep).admissible()) continue;
    if (!sample(lift, q_start, 0, last_tick(lift), ends_)) continue;
    way.lift = lift;
    way.q_lift = q_start;
    way.duration = last_tick(lift) * tick_;
    from = ends_.back();
    return true;
  }
  return false;
}

void StrokeSearch::try_hit(const StrokeRequest& request, const JointVector& q, double share, const StrokeWay& start, const MotionState& from) {
  const double v = request.speed;
  const JointVector per_way = tracker_.joint_speed(q, {request.direction_W.x(), request.direction_W.y(), 0.0});
  const JointVector per_climb = tracker_.joint_speed(q, Vector3::UnitZ());
  reached(SearchStage::kSpeed);
  if (((v * per_way).cwiseAbs().array() > limits_.speed.array()).any()) return;
  reached(SearchStage::kArea);

  const double height = settings_->safe_height() - settings_->tip_height;
  for (const Shares& shares : kShares) {
    for (const double scale : kScales) {
      const double vertical = share * scale * shares.vertical;
      const double climb = tip_limit(per_climb, vertical * limits_.acceleration);
      const double climb_jerk = tip_limit(per_climb, vertical * limits_.jerk);
      const double horizontal = share * scale * shares.horizontal;
      const double push = tip_limit(per_way, horizontal * limits_.acceleration);
      const double push_jerk = tip_limit(per_way, horizontal * limits_.jerk);

      StrokeWay way = start;
      way.q_dip = q;
      Dip dip;
      dip.p_WS = request.p_WS;
      dip.direction_W = request.direction_W;
      dip.low = settings_->tip_height;

      // Before the contact: the first run-up that keeps the limits.
      const int run_ups = shares.horizontal == 0.0 ? 1 : static_cast<int>(kEntrySpeeds.size());
      bool found = false;
      for (int i = 0; i < run_ups && !found; ++i) {
        dip.run_up = shares.horizontal == 0.0 ? SpeedRamp{v, v, 1.0, 1.0} : SpeedRamp{v, kEntrySpeeds[static_cast<std::size_t>(i)] * v, push, push_jerk};
        const double run_in_time = time_to_way(dip.run_up, request.run_in);
        dip.fall = Rise{climb, climb_jerk, true};
        dip.level = run_in_time - dip.fall.time_to(settings_->run_in_band);
        if (dip.level > 0.0) {  // the swoop alone is too short: a level run-in, and a lift whose acceleration must build up
          dip.fall = Rise{climb, climb_jerk, false};
          dip.level = std::max(0.0, run_in_time - dip.fall.time_to(settings_->run_in_band));
          dip.rise = dip.fall;
        } else {
          dip.level = 0.0;
          dip.rise = dip.fall;
        }
        dip.begin = -(dip.level + dip.fall.time_to(height));
        if (!(dip.begin > -5.0) || !in_area(dip, dip.begin, 0.0)) continue;
        reached(SearchStage::kLimits);
        found = use_of(dip, tracker_, limits_, q, dip.begin, kDipStep).admissible();
      }
      if (!found) continue;

      // After it: on at constant speed when that can be, else braking.
      dip.end = dip.rise.time_to(height);
      found = false;
      for (const bool brakes : {false, true}) {
        if (brakes && shares.horizontal == 0.0) break;
        dip.brake = brakes ? SpeedRamp{v, 0.0, push, push_jerk} : SpeedRamp{v, v, 1.0, 1.0};
        if (!in_area(dip, 0.0, dip.end)) continue;
        found = use_of(dip, tracker_, limits_, q, dip.end, kDipStep).admissible();
        if (found) break;
      }
      if (!found) continue;
      way.dip = dip;
      if (try_transits(request, way, from)) return;
    }
  }
}

void StrokeSearch::try_push(const StrokeRequest& request, const JointVector& q, double share, const StrokeWay& start, const MotionState& from) {
  const double v = request.speed;
  const JointVector per_way = tracker_.joint_speed(q, {request.direction_W.x(), request.direction_W.y(), 0.0});
  const JointVector per_climb = tracker_.joint_speed(q, Vector3::UnitZ());
  reached(SearchStage::kSpeed);
  if (((v * per_way).cwiseAbs().array() > limits_.speed.array()).any()) return;
  reached(SearchStage::kLimits);

  const double height = settings_->safe_height() - settings_->tip_height;
  for (const double scale : kScales) {
    const double part = 0.9 * share * scale;
    Dip dip;
    dip.p_WS = request.p_WS;
    dip.direction_W = request.direction_W;
    dip.low = settings_->tip_height;
    dip.fall = Rise{tip_limit(per_climb, part * limits_.acceleration), tip_limit(per_climb, part * limits_.jerk), false};
    dip.rise = dip.fall;
    dip.begin = -dip.fall.time_to(height);
    const double push = tip_limit(per_way, part * limits_.acceleration);
    const double push_jerk = tip_limit(per_way, part * limits_.jerk);
    dip.set_off = SpeedRamp{0.0, v, push, push_jerk};
    dip.slow_down = SpeedRamp{v, 0.0, push, push_jerk};
    const double rest = request.length - dip.set_off.length() - dip.slow_down.length();
    if (rest < 0.0) {
      reached(SearchStage::kSpeed);  // too short to reach the speed
      continue;
    }
    dip.cruise = rest / v;
    dip.end = dip.line_time() + dip.rise.time_to(height);
    if (!use_of(dip, tracker_, limits_, q, dip.begin, kDipStep).admissible()) continue;
    if (!use_of(dip, tracker_, limits_, q, dip.end, std::max(kDipStep, dip.end / kMostSamples)).admissible()) continue;
    StrokeWay way = start;
    way.q_dip = q;
    way.dip = dip;
    if (try_transits(request, way, from)) return;
  }
}

bool StrokeSearch::try_transits(const StrokeRequest& request, StrokeWay way, const MotionState& from) {
  reached(SearchStage::kTransit);
  MotionState leave = from;
  if (way.dip) {
    if (!sample(*way.dip, way.q_dip, first_tick(*way.dip), last_tick(*way.dip), ends_)) return false;
    leave = ends_.back();
    if (!transit_.plan(from, ends_.front())) return false;
    way.duration += transit_.duration() + static_cast<double>(ends_.size() - 1) * tick_;
    if (best_ && way.duration >= best_->duration) return true;
    if (!transit_is_clear(settings_->safe_height())) return false;
  }
  way.q_end = settings_->park;
  if (!request.park_after && request.kind != StrokeKind::kPark) {
    // Come to rest over the place, a little higher.
    way.q_end = leave.q;
    Vector3 p_WT = arm_->tip_in_world(leave.q).translation();
    for (int i = 0; i < 10; ++i) {
      p_WT.z() += 0.01;
      JointVector q = way.q_end;
      if (!tracker_.follow(p_WT, {0.0, 0.0, -1.0}, q)) break;
      way.q_end = q;
    }
  }
  if (!transit_.plan(leave, MotionState::at_rest(way.q_end))) return false;
  way.duration += transit_.duration();
  if (best_ && way.duration >= best_->duration) return true;
  if (!transit_is_clear(settings_->safe_height())) return false;
  best_ = way;
  return true;
}

bool StrokeSearch::transit_is_clear(double floor) {
  MotionState state;
  const int n = std::max(1, static_cast<int>(std::ceil(transit_.duration() / kTransitStep)));
  for (int k = 0; k <= n; ++k) {
    transit_.at(transit_.duration() * k / n, state);
    if (!arm_->within_limits(state.q)) return false;
    const ArmClearance::Heights heights = clearance_->heights(state.q);
    if (heights.tip < floor - kHeightTolerance || heights.links < settings_->link_clearance) return false;
  }
  return true;
}

}  // namespace breakshot::motion
