#include "controller/motion/stroke_planner.hpp"

#include "controller/motion/trajectory_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <stdexcept>

namespace breakshot::motion {
namespace {

/// Shares of acceleration and jerk that dips may use. The search samples coarsely; when its first answer does not stand the check of every
/// tick, the next one leaves more room.
constexpr std::array kDipShares{0.97, 0.85, 0.7};
/// Rounding that the check forgives, relative to a limit.
constexpr double kRounding = 1e-3;
/// How far from unit length a direction may be.
constexpr double kUnitTolerance = 1e-3;
constexpr double kSlowestStroke = 0.01;  ///< m/s
constexpr double kShortestPush = 0.005;  ///< m
/// Ticks between the postures of which the singularity margin is taken: it changes by less than a percent in 10 ms.
constexpr std::size_t kMarginEvery = 10;
/// Steps of the search for the attainable speed: the answer is within 1/64 of the asked speed of the largest one.
constexpr int kBisections = 6;

[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...) {
  std::array<char, 256> buffer{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer.data(), buffer.size(), format, arguments);
  va_end(arguments);
  return buffer.data();
}

Refusal bad(std::string why) { return {RefusalReason::kBadRequest, 0.0, std::move(why)}; }

}  // namespace

StrokePlanner::StrokePlanner(const ArmDescription& arm, const Pose& X_WB, const MotionSettings& settings)
    : settings_{settings},
      kinematics_{arm, X_WB},
      ik_{kinematics_},
      clearance_{arm, kinematics_, settings.striker_radius},
      search_{kinematics_, ik_, clearance_, settings_} {
  if (settings.park.size() != kinematics_.joints()) {
    throw std::invalid_argument{text("park pose: %d joints, the arm has %d", static_cast<int>(settings.park.size()), kinematics_.joints())};
  }
  if (!kinematics_.within_limits(settings.park)) throw std::invalid_argument{"park pose: a joint is outside of its range"};
  const ArmClearance::Heights heights = clearance_.heights(settings.park);
  if (heights.tip < settings.safe_height() || heights.links < settings.link_clearance) {
    throw std::invalid_argument{text("park pose: tip %.3f m and links %.3f m above the table; allowed from %.3f and %.3f m", heights.tip,
                                     heights.links, settings.safe_height(), settings.link_clearance)};
  }
  if (!(settings.tip_height > 0.0 && settings.tip_height + settings.run_in_band < settings.disc_height)) {
    throw std::invalid_argument{text("tip height %.4f m with a run-in band of %.4f m must lie between the table and the disc tops (%.4f m)",
                                     settings.tip_height, settings.run_in_band, settings.disc_height)};
  }
}

std::optional<Refusal> StrokePlanner::validate(const StrokeRequest& request, const MotionState& start) const {
  for (const JointVector* part : {&start.q, &start.qd, &start.qdd}) {
    if (part->size() != kinematics_.joints() || !part->allFinite()) return bad("start: joint positions missing or not finite");
  }
  if (!kinematics_.within_limits(start.q, 1e-3)) return Refusal{RefusalReason::kJointLimit, 0.0, "start: a joint is outside of its range"};
  if (request.kind == StrokeKind::kPark) return std::nullopt;
  if (request.kind != StrokeKind::kHit && request.kind != StrokeKind::kPush) {
    return bad(text("kind: found %d; allowed hit, push, park", static_cast<int>(request.kind)));
  }
  if (!request.p_WS.allFinite()) return bad("p_WS: not finite");
  const double norm = request.direction_W.norm();
  if (!(std::abs(norm - 1.0) <= kUnitTolerance)) return bad(text("direction_W: length %g; allowed 1 within %g", norm, kUnitTolerance));
  const bool hit = request.kind == StrokeKind::kHit;
  const double fastest = hit ? settings_.max_hit_speed : settings_.max_push_speed;
  if (!(request.speed >= kSlowestStroke && request.speed <= fastest)) {
    return bad(text("speed: %g m/s; a %s is allowed %g to %g", request.speed, to_string(request.kind), kSlowestStroke, fastest));
  }
  if (hit && !(request.run_in >= 0.0 && request.run_in <= settings_.max_run_in)) {
    return bad(text("run_in: %g m; allowed 0 to %g", request.run_in, settings_.max_run_in));
  }
  if (!hit && !(request.length >= kShortestPush && request.length <= settings_.max_length)) {
    return bad(text("length: %g m; allowed %g to %g", request.length, kShortestPush, settings_.max_length));
  }
  const Vector2 end = hit ? request.p_WS : Vector2{request.p_WS + request.length * request.direction_W};
  for (const Vector2& p : {request.p_WS, end}) {
    if (settings_.striker_area.contains(p)) continue;
    return Refusal{RefusalReason::kOutOfBounds, 0.0,
                   text("striker axis at (%.3f, %.3f) m; allowed [%.3f, %.3f] x [%.3f, %.3f]", p.x(), p.y(), settings_.striker_area.min.x(),
                        settings_.striker_area.max.x(), settings_.striker_area.min.y(), settings_.striker_area.max.y())};
  }
  return std::nullopt;
}

Result<StrokeTimes, Refusal> StrokePlanner::plan(const StrokeRequest& asked, const MotionState& start, Trajectory& out) {
  if (auto refusal = validate(asked, start)) return *std::move(refusal);
  StrokeRequest request = asked;
  if (request.kind != StrokeKind::kPark) request.direction_W.normalize();
  // The quickest way, else any: the one may fail the check of every tick where the other stands it.
  for (const bool first_found : {false, true}) {
    if (const auto times = try_plan(request, start, first_found, out)) return *times;
  }
  if (!start.rests() && search_.stage() != SearchStage::kReach) {
    return Refusal{RefusalReason::kJointLimit, 0.0, "no way from this motion within the joints' limits"};
  }
  return refuse(request, start, search_.stage(), out);
}

Result<StrokeTimes, Refusal> StrokePlanner::estimate(const StrokeRequest& asked, const JointVector& q_start) {
  const MotionState start = MotionState::at_rest(q_start);
  if (auto refusal = validate(asked, start)) return *std::move(refusal);
  StrokeRequest request = asked;
  if (request.kind != StrokeKind::kPark) request.direction_W.normalize();
  if (const auto way = search_.find(request, start, kDipShares[0], false)) return times_of(request, *way);
  const bool reached = search_.stage() != SearchStage::kReach;
  return Refusal{reached ? RefusalReason::kTooFast : RefusalReason::kUnreachable, 0.0, "no way found within the limits"};
}

std::optional<StrokeTimes> StrokePlanner::try_plan(const StrokeRequest& request, const MotionState& start, bool first_found,
                                                   Trajectory& out) {
  for (const double share : kDipShares) {
    const auto way = search_.find(request, start, share, first_found);
    if (!way) return std::nullopt;
    if (!assemble(request, *way, start, out)) {
      if (too_long_) return std::nullopt;
      continue;
    }
    if (!keeps_limits(out)) continue;
    StrokeTimes times = times_of(request, *way);
    times.contact = way->dip ? static_cast<std::int64_t>(out.contact_tick) * out.tick : Duration{0};
    times.total = static_cast<std::int64_t>(out.size - 1) * out.tick;
    times.singularity_margin = singularity_margin_;
    return times;
  }
  return std::nullopt;
}

StrokeTimes StrokePlanner::times_of(const StrokeRequest& request, const StrokeWay& way) const {
  StrokeTimes times;
  times.total = from_seconds(way.duration);
  if (!way.dip) return times;
  const Dip& dip = *way.dip;
  const double over_low = settings_.disc_height - settings_.tip_height;
  const double rise_time = dip.rise.time_to(over_low);
  const double line_end = request.kind == StrokeKind::kPush ? request.length : 0.0;
  times.low_before = -dip.way(-(dip.level + dip.fall.time_to(over_low)));
  times.low_after = dip.way(dip.line_time() + rise_time) - line_end;
  times.low_time = from_seconds(rise_time);
  return times;
}

bool StrokePlanner::append(const MotionState& state, StrokePhase phase, Trajectory& out) const {
  if (out.size >= Trajectory::kCapacity) return false;
  TrajectoryPoint& point = out.points[out.size++];
  for (int i = 0; i < out.joints; ++i) {
    const auto j = static_cast<std::size_t>(i);
    point.q[j] = state.q[i];
    point.qd[j] = state.qd[i];
    point.qdd[j] = state.qdd[i];
  }
  point.phase = phase;
  return true;
}

bool StrokePlanner::append_transit(const MotionState& from, const MotionState& to, StrokePhase phase, Trajectory& out) {
  Transit& transit = search_.transit();
  if (!transit.plan(from, to)) return false;
  const double tick = to_seconds(settings_.tick);
  const int n = static_cast<int>(std::lround(transit.duration() / tick));
  MotionState state;
  for (int k = 0; k < n; ++k) {
    transit.at(k * tick, state);
    if (!append(state, phase, out)) {
      too_long_ = true;
      return false;
    }
  }
  return true;
}

bool StrokePlanner::assemble(const StrokeRequest& request, const StrokeWay& way, const MotionState& start, Trajectory& out) {
  out.stroke_id = request.id;
  out.joints = kinematics_.joints();
  out.size = 0;
  out.tick = settings_.tick;
  low_from_ = 1;  // nothing is low ...
  low_to_ = 0;
  singularity_margin_ = 0.0;
  too_long_ = false;
  const double tick = to_seconds(settings_.tick);
  const auto append_dip = [&](const Dip& dip, int first, auto&& phase_at) {
    for (std::size_t k = 0; k + 1 < states_.size(); ++k) {  // the last state is the first one of the transit that follows
      if (append(states_[k], phase_at(dip, (first + static_cast<int>(k)) * tick), out)) continue;
      too_long_ = true;
      return false;
    }
    return true;
  };

  MotionState state = start;
  if (way.lift) {
    if (!sample(*way.lift, search_.tracker(), way.q_lift, 0, search_.last_tick(*way.lift), tick, states_)) return false;
    states_.front() = state;
    if (!append_dip(*way.lift, 0, [&](const Dip&, double) { return way.dip ? StrokePhase::kTransit : StrokePhase::kRetreat; }))
      return false;
    state = states_.back();
    low_from_ = 0;
    low_to_ = out.size;
  }
  if (way.dip) {
    const Dip& dip = *way.dip;
    const int first = search_.first_tick(dip);
    if (!sample(dip, search_.tracker(), way.q_dip, first, search_.last_tick(dip), tick, states_)) return false;
    if (!append_transit(state, states_.front(), StrokePhase::kTransit, out)) return false;
    if (!way.lift) low_from_ = out.size;
    out.contact_tick = out.size + static_cast<std::size_t>(-first);
    const double over_low = settings_.disc_height - settings_.tip_height;
    const double line_end = dip.line_time();
    const auto phase_at = [&](const Dip& d, double t) {
      if (t < 0.0) return d.way(t) >= -request.run_in && request.kind == StrokeKind::kHit ? StrokePhase::kRunIn : StrokePhase::kTransit;
      if (t < line_end) return StrokePhase::kRunIn;
      return d.rise.height(t - line_end) < over_low ? StrokePhase::kFollowThrough : StrokePhase::kRetreat;
    };
    if (!append_dip(dip, first, phase_at)) return false;
    state = states_.back();
    low_to_ = out.size;
    singularity_margin_ = search_.tracker().singularity_margin(state.q);
    for (std::size_t k = 0; k < states_.size(); k += kMarginEvery)
      singularity_margin_ = std::min(singularity_margin_, search_.tracker().singularity_margin(states_[k].q));
  }
  const MotionState end = MotionState::at_rest(way.q_end);
  if (!append_transit(state, end, StrokePhase::kParking, out)) return false;
  if (!append(end, StrokePhase::kParking, out)) {
    too_long_ = true;
    return false;
  }
  if (!way.dip) out.contact_tick = out.size;
  return true;
}

bool StrokePlanner::keeps_limits(const Trajectory& trajectory) const {
  const TrajectoryUse use = measure(trajectory, low_from_, low_to_, search_.limits(), clearance_);
  const double lowest = std::min(settings_.tip_height, use.lowest_tip_outside) - 1e-6;
  return use.speed <= 1.0 + kRounding && use.acceleration <= 1.0 + kRounding && use.jerk <= 1.0 + kRounding && use.out_of_range <= 1e-6 &&
         (low_to_ > 0 || use.lowest_tip >= lowest) && use.lowest_tip_outside >= settings_.safe_height() - 2e-3 &&
         use.lowest_link >= settings_.link_clearance - 1e-4;
}

Refusal StrokePlanner::refuse(const StrokeRequest& request, const MotionState& start, SearchStage stage, Trajectory& out) {
  if (too_long_) {
    return {RefusalReason::kTooLong, 0.0,
            text("the stroke takes longer than %.1f s", static_cast<double>(Trajectory::kCapacity) * to_seconds(settings_.tick))};
  }
  if (request.kind == StrokeKind::kPark)
    return {RefusalReason::kJointLimit, 0.0, "no clear way to the park pose within the joints' limits"};
  const double x = request.p_WS.x();
  const double y = request.p_WS.y();
  if (stage == SearchStage::kReach)
    return {RefusalReason::kUnreachable, 0.0, text("no joint positions put the striker at (%.3f, %.3f) m", x, y)};

  StrokeRequest slower = request;
  const auto accepted = [&](double speed) {  // then plan() accepts it, too
    slower.speed = speed;
    return speed >= kSlowestStroke && try_plan(slower, start, true, out).has_value();
  };
  double low = 0.0;
  double high = std::min(request.speed, std::max(speed_bound(request.p_WS, request.direction_W), kSlowestStroke));
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (accepted(middle) ? low : high) = middle;
  }
  // Plans are not strictly better the slower they are; what is promised is tried.
  double speed = low;
  while (speed >= kSlowestStroke) {
    if (accepted(0.99 * speed) && accepted(speed)) {
      return {RefusalReason::kTooFast, speed,
              text("%s at (%.3f, %.3f) m along (%.3f, %.3f): %.3f m/s asked, %.3f m/s attainable", to_string(request.kind), x, y,
                   request.direction_W.x(), request.direction_W.y(), request.speed, speed)};
    }
    speed *= 0.9;
  }
  if (stage == SearchStage::kArea)
    return {RefusalReason::kOutOfBounds, 0.0, text("the run-in to (%.3f, %.3f) m leaves the striker's area", x, y)};
  return {RefusalReason::kJointLimit, 0.0,
          text("%s at (%.3f, %.3f) m along (%.3f, %.3f): no way within the joints' limits at any speed", to_string(request.kind), x, y,
               request.direction_W.x(), request.direction_W.y())};
}

}  // namespace breakshot::motion
