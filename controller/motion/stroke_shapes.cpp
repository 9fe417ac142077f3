#include "controller/motion/stroke_shapes.hpp"

#include <cmath>
#include <limits>
#include <utility>

// StrokeSearch at one branch of the arm: the shapes of the dip, from the most to the least demanding, of hits and pushes.

namespace breakshot::motion {
namespace {

/// Longest that a hit may take from the safe height to the contact, s.
constexpr double kLongestApproach = 2.0;
/// Most samples of a dip on one side of time 0; long pushes are slow, so their samples stay a few millimetres apart.
constexpr int kMostSamples = 120;
/// Tip speeds at which a hit's tip leaves the safe height, relative to the speed at contact. At 1 all of the acceleration is the transit's;
/// at 0 the tip comes straight down and all of it is the run-in's, which takes least room.
constexpr std::array kEntrySpeeds{1.0, 0.6, 0.3, 0.0};
/// No tip accelerates more, m/s^2: stands for "no limit".
constexpr double kMostAcceleration = 50.0;
/// Least acceleration along the line that is worth a try, m/s^2.
constexpr double kLeastAcceleration = 0.3;
/// What a metre of low corridor counts for in time, s/m. Past the contact: discs that are met twice cost strokes. Before the run-in, beyond
/// MotionSettings::descent: whoever asks keeps no more than that free of other discs.
constexpr double kFollowThroughCost = 5.0;
constexpr double kDescentCost = 10.0;

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

}  // namespace breakshot::motion
