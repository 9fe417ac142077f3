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

Use use_of(const Dip& dip, const TipTracker& tracker, const JointLimits& limits, const JointVector& q0, double to, double step) noexcept {
  Use use;
  const int n = std::max(2, static_cast<int>(std::ceil(std::abs(to) / step)));
  const double h = to / n;  // negative when going back in time: derivatives keep their meaning
  JointVector q = q0;
  JointVector qd_last, qdd_last;
  // One step beyond either end, so that acceleration is known at the ends too.
  for (int k = 0; k <= n + 1; ++k) {
    const Dip::Tip tip = dip.at(k * h);
    if (!tracker.follow(tip.p_WT, dip.axis_W, q) || (q.array() < limits.lower.array()).any() || (q.array() > limits.upper.array()).any()) {
      use.reachable = false;
      return use;
    }
    const JointVector qd = tracker.joint_speed(q, tip.v_WT_W);
    use.speed = std::max(use.speed, (qd.array() / limits.speed.array()).abs().maxCoeff());
    if (k >= 1) {
      const JointVector qdd = (qd - qd_last) / h;
      use.acceleration = std::max(use.acceleration, qdd.cwiseAbs().maxCoeff() / limits.acceleration);
      if (k >= 2) use.jerk = std::max(use.jerk, (qdd - qdd_last).cwiseAbs().maxCoeff() / (std::abs(h) * limits.jerk));
      qdd_last = qdd;
    }
    qd_last = qd;
    if (use.speed > 1.0 || use.worst() > 4.0) return use;
  }
  return use;
}

}  // namespace breakshot::motion
