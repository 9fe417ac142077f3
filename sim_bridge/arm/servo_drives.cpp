#include "sim_bridge/arm/servo_drives.hpp"

#include <algorithm>
#include <cmath>

namespace breakshot::sim_bridge {
namespace {

/// Rounding on the way here must not turn a set-point on a limit into a refused one.
constexpr double kRangeTolerance = 1e-6;   // rad
constexpr double kSpeedTolerance = 1.001;  // factor
/// A command that comes so late that the arm could not get there in time is aimed at this much ahead, straight on from it: time to make good in what
/// the drives, going straight on without it, were off by.
constexpr Duration kLateAim = std::chrono::milliseconds{8};

JointVector limits_of(const ArmDescription& arm, double JointDescription::*limit) {
  JointVector values(static_cast<Eigen::Index>(arm.joints.size()));
  for (std::size_t i = 0; i < arm.joints.size(); ++i) values[static_cast<Eigen::Index>(i)] = arm.joints[i].*limit;
  return values;
}

}  // namespace

const char* to_string(CommandVerdict verdict) noexcept {
  switch (verdict) {
    case CommandVerdict::kTaken: return "taken";
    case CommandVerdict::kMalformed: return "malformed";
    case CommandVerdict::kOutOfRange: return "out of range";
    case CommandVerdict::kTooFast: return "too fast";
    case CommandVerdict::kJump: return "jump";
    case CommandVerdict::kOld: return "old";
    case CommandVerdict::kBadDue: return "bad due";
    case CommandVerdict::kOtherSession: return "other session";
  }
  return "invalid";
}

ServoDrives::ServoDrives(const ArmDescription& arm, const DriveSettings& settings, const JointVector& q)
    : joints_{static_cast<int>(arm.joints.size())},
      settings_{settings},
      lower_{limits_of(arm, &JointDescription::lower)},
      upper_{limits_of(arm, &JointDescription::upper)},
      max_speed_{limits_of(arm, &JointDescription::max_speed)},
      brake_from_{q, JointVector::Zero(joints_), JointVector::Zero(joints_)} {}

CommandVerdict ServoDrives::judge(const JointCommand& command, Time now) const noexcept {
  const bool shaped = command.q.size() == joints_ && command.qd.size() == joints_ && command.qdd.size() == joints_;
  if (!shaped || !command.q.allFinite() || !command.qd.allFinite() || !command.qdd.allFinite()) return CommandVerdict::kMalformed;
  if (!braked_ && command.session != session_) return CommandVerdict::kOtherSession;
  if (command.session == session_ && command.seq <= command_seq_) return CommandVerdict::kOld;
  if (command.due > now + settings_.horizon || command.due < now - settings_.silence_limit) return CommandVerdict::kBadDue;
  if ((command.q.array() < lower_.array() - kRangeTolerance).any() || (command.q.array() > upper_.array() + kRangeTolerance).any()) {
    return CommandVerdict::kOutOfRange;
  }
  if ((command.qd.array().abs() > max_speed_.array() * kSpeedTolerance).any()) return CommandVerdict::kTooFast;

  if (!braked_ && command.due <= knot(0).due) return CommandVerdict::kOld;
  return leg(command, now) ? CommandVerdict::kTaken : CommandVerdict::kJump;
}

std::optional<ServoDrives::Leg> ServoDrives::leg(const JointCommand& command, Time now) const noexcept {
  const Time at = now - settings_.lag;
  Leg leg{{}, {command.due, command.q, command.qd, command.qdd}};
  if (!braked_ && knot(0).due > at) {
    leg.from = knot(0);
  } else {
    // Braked, or past the newest set-point: from where the reference is now, so that taking the command is as smooth as following.
    const DriveReference here = reference(now);
    leg.from = {at, here.q, here.qd, here.qdd};
  }
  if (leg.to.due > leg.from.due && within_speed(leg)) return leg;
  if (leg.to.due - at >= kLateAim) return std::nullopt;
  leg.to.q += leg.to.qd * to_seconds(at + kLateAim - leg.to.due);
  leg.to.due = at + kLateAim;
  if (leg.to.due > leg.from.due && within_speed(leg)) return leg;
  return std::nullopt;
}

// The speed of the cubic is a parabola in u: the largest is at an end or at the vertex.
bool ServoDrives::within_speed(const Leg& leg) const noexcept {
  const double span = to_seconds(leg.to.due - leg.from.due);
  for (int i = 0; i < joints_; ++i) {
    const double v0 = leg.from.qd[i];
    const double v1 = leg.to.qd[i];
    const double mean = (leg.to.q[i] - leg.from.q[i]) / span;
    const double a = 3.0 * (v0 + v1) - 6.0 * mean;
    const double b = 6.0 * mean - 4.0 * v0 - 2.0 * v1;
    const double u = a != 0.0 ? std::clamp(-0.5 * b / a, 0.0, 1.0) : 0.0;
    const double limit = kSpeedTolerance * max_speed_[i];
    for (const double speed : {v0, v1, v0 + u * (b + u * a)}) {
      if (!(std::abs(speed) <= limit)) return false;
    }
  }
  return true;
}

CommandVerdict ServoDrives::take(const JointCommand& command, Time now) noexcept {
  const CommandVerdict verdict = judge(command, now);
  ++verdicts_[static_cast<std::size_t>(verdict)];
  if (verdict != CommandVerdict::kTaken) return verdict;

  const Leg way = *leg(command, now);
  if (braked_) {
    restart(way.from);
    braked_ = false;
  } else if (way.from.due > knot(0).due) {
    push(way.from);
  }
  push(way.to);
  session_ = command.session;
  command_seq_ = command.seq;
  taken_at_ = now;
  return verdict;
}

void ServoDrives::watch(Time now) noexcept {
  if (braked_ || now - taken_at_ <= settings_.silence_limit) return;
  brake_from_ = reference(now);
  brake_from_.qdd.setZero();
  brake_began_ = now;
  brake_time_ = from_seconds(brake_from_.qd.cwiseAbs().maxCoeff() / settings_.brake_deceleration);
  braked_ = true;
}

DriveReference ServoDrives::reference(Time now) const noexcept {
  DriveReference reference = braked_ ? slow_down(now) : follow(now - settings_.lag);
  // Straight on past the newest set-point, or a brake begun near the end of a range, would leave it: the drives stop there.
  for (int i = 0; i < joints_; ++i) {
    const double inside = std::clamp(reference.q[i], lower_[i], upper_[i]);
    if (inside == reference.q[i]) continue;
    reference.q[i] = inside;
    reference.qd[i] = 0.0;
    reference.qdd[i] = 0.0;
  }
  return reference;
}

bool ServoDrives::holds_still(Time now) const noexcept {
  if (braked_) return now >= brake_began_ + brake_time_;
  return now - settings_.lag >= knot(0).due && knot(0).qd.isZero(0.0);
}

void ServoDrives::push(const Knot& knot) noexcept {
  newest_ = (newest_ + 1) % kKnots;
  knots_[newest_] = knot;
  count_ = std::min(count_ + 1, kKnots);
}

void ServoDrives::restart(const Knot& first) noexcept {
  count_ = 0;
  push(first);
}

DriveReference ServoDrives::follow(Time at) const noexcept {
  const Knot& last = knot(0);
  if (at >= last.due) {
    return {last.q + last.qd * to_seconds(at - last.due), last.qd, JointVector::Zero(joints_)};
  }
  std::size_t age = 1;
  while (age < count_ && knot(age).due > at) ++age;
  if (age == count_) return {knot(age - 1).q, JointVector::Zero(joints_), JointVector::Zero(joints_)};

  const Knot& a = knot(age);
  const Knot& b = knot(age - 1);
  const double span = to_seconds(b.due - a.due);
  const double u = to_seconds(at - a.due) / span;
  const double v = 1.0 - u;
  // Cubic Hermite basis and its derivative by u.
  const double h00 = (1.0 + 2.0 * u) * v * v, h10 = u * v * v, h01 = u * u * (3.0 - 2.0 * u), h11 = -u * u * v;
  const double d00 = -6.0 * u * v, d10 = v * (1.0 - 3.0 * u), d11 = u * (3.0 * u - 2.0);
  return {h00 * a.q + h10 * span * a.qd + h01 * b.q + h11 * span * b.qd, d00 / span * (a.q - b.q) + d10 * a.qd + d11 * b.qd,
          v * a.qdd + u * b.qdd};
}

DriveReference ServoDrives::slow_down(Time now) const noexcept {
  if (now >= brake_began_ + brake_time_) {
    return {brake_from_.q + brake_from_.qd * (0.5 * to_seconds(brake_time_)), JointVector::Zero(joints_), JointVector::Zero(joints_)};
  }
  const double total = to_seconds(brake_time_);
  const double gone = to_seconds(now - brake_began_);
  return {brake_from_.q + brake_from_.qd * (gone - 0.5 * gone * gone / total), brake_from_.qd * (1.0 - gone / total),
          -brake_from_.qd / total};
}

}  // namespace breakshot::sim_bridge
