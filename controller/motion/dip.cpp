#include "controller/motion/dip.hpp"

#include <cmath>

namespace breakshot::motion {

double Dip::way(double t) const noexcept {
  if (t < 0.0) return -run_up.position(-t);
  if (t <= set_off.duration()) return set_off.position(t);
  const double cruise_speed = set_off.speed(set_off.duration());
  t -= set_off.duration();
  if (t <= cruise) return set_off.length() + cruise_speed * t;
  t -= cruise;
  const double before_end = set_off.length() + cruise_speed * cruise;
  if (t <= slow_down.duration()) return before_end + slow_down.position(t);
  return before_end + slow_down.length() + brake.position(t - slow_down.duration());
}

Dip::Tip Dip::at(double t) const noexcept {
  double speed = 0.0;
  double height = 0.0;
  double climb = 0.0;
  const double line = line_time();
  if (t <= 0.0) {
    speed = run_up.speed(-t);
    height = fall.height(-t - level);
    climb = -fall.speed(-t - level);
  } else if (t < line) {
    const double rest = line - t;
    if (t < set_off.duration()) {
      speed = set_off.speed(t);
    } else {
      speed = slow_down.speed(slow_down.duration() - rest);
    }
  } else {
    speed = brake.speed(t - line);
    height = rise.height(t - line);
    climb = rise.speed(t - line);
  }
  const Vector2 p = p_WS + way(t) * direction_W;
  const Vector2 v = speed * direction_W;
  return {{p.x(), p.y(), low + height}, {v.x(), v.y(), climb}};
}

DipUse use_of(const Dip& dip, const TipTracker& tracker, const JointLimits& limits, const JointVector& q0, double to,
              double step) noexcept {
  DipUse use;
  const int n = std::max(2, static_cast<int>(std::ceil(std::abs(to) / step)));
  const double h = to / n;  // negative when going back in time: derivatives keep their meaning
  JointVector q = q0;
  JointVector qd = JointVector::Zero(q.size());
  JointVector qdd = JointVector::Zero(q.size());
  // One step beyond the end, from which the acceleration there follows.
  for (int k = 0; k <= n + 1; ++k) {
    const Dip::Tip tip = dip.at(k * h);
    const JointVector qd_last = qd;
    if (k > 0) q += h * qd + 0.5 * h * h * qdd;
    if (!tracker.follow(tip.p_WT, tip.v_WT_W, dip.axis_W, q, qd)) return use;
    if (k <= n && ((q.array() < limits.lower.array()).any() || (q.array() > limits.upper.array()).any())) return use;
    if (k <= n) use.speed = std::max(use.speed, (qd.array() / limits.speed.array()).abs().maxCoeff());
    if (k >= 1) {
      const JointVector qdd_last = qdd;
      qdd = (qd - qd_last) / h;
      use.acceleration = std::max(use.acceleration, qdd.cwiseAbs().maxCoeff() / limits.acceleration);
      if (k >= 2) use.jerk = std::max(use.jerk, (qdd - qdd_last).cwiseAbs().maxCoeff() / (std::abs(h) * limits.jerk));
      if (k == n + 1) use.end.qdd = 0.5 * (qdd + qdd_last);
    }
    if (k == n) {
      use.end.q = q;
      use.end.qd = qd;
    }
    if (std::max({use.speed, use.acceleration, use.jerk}) > 1.0) break;  // nobody asks by how much
  }
  use.reachable = true;
  return use;
}

bool sample(const Dip& dip, const TipTracker& tracker, const JointVector& q0, int first, int last, double tick,
            std::vector<MotionState>& states) {
  // One tick more at either end, from which the acceleration at the ends follows.
  const auto at = [&](int k) -> MotionState& { return states[static_cast<std::size_t>(k - first + 1)]; };
  states.resize(static_cast<std::size_t>(last - first + 3));
  for (const int direction : {-1, 1}) {
    JointVector q = q0;
    JointVector qd = JointVector::Zero(q.size());
    JointVector qd_last = qd;
    for (int k = 0; k >= first - 1 && k <= last + 1; k += direction) {
      const Dip::Tip tip = dip.at(k * tick);
      // The mean speed until the next tick, from this one's and the last one's.
      q += direction * tick * (1.5 * qd - 0.5 * qd_last);
      qd_last = qd;
      if (!tracker.follow(tip.p_WT, tip.v_WT_W, dip.axis_W, q, qd)) return false;
      at(k) = {q, qd, JointVector::Zero(q.size())};
    }
  }
  for (int k = first; k <= last; ++k) at(k).qdd = (at(k + 1).qd - at(k - 1).qd) / (2.0 * tick);
  states.erase(states.begin());
  states.pop_back();
  return true;
}

}  // namespace breakshot::motion
