#include "tests/support/stroke_audit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace breakshot::support {
namespace {

using motion::Trajectory;
using motion::TrajectoryPoint;

/// Samples per tick.
constexpr int kSamples = 4;
/// The disc that a hit is imagined to meet: the cell's own (config/cell.yaml), alone, struck head-on by an arm of 1.2 kg at the tip.
constexpr double kDiscRadius = 0.030;
constexpr double kDiscSpeedGain = 1.8 / (1.0 + 0.1 / 1.2);  // (1 + e) / (1 + m / M), e = 0.8
constexpr double kDiscFriction = 0.25;
/// Of a state that is given from one trajectory to the next: rad, rad/s, rad/s^2.
constexpr double kRounding = 1e-9;
/// A push slower than this has no direction worth the name, m/s.
constexpr double kMoving = 0.005;

/// State of the joints between two points, as the drives interpolate it.
struct Between {
  JointVector q, qd;
};

Between hermite(const TrajectoryPoint& a, const TrajectoryPoint& b, int joints, double h, double s) {
  Between state{JointVector(joints), JointVector(joints)};
  for (int i = 0; i < joints; ++i) {
    const auto j = static_cast<std::size_t>(i);
    const double step = b.q[j] - a.q[j];
    const double c2 = 3.0 * step - h * (2.0 * a.qd[j] + b.qd[j]);
    const double c3 = -2.0 * step + h * (a.qd[j] + b.qd[j]);
    state.q[i] = a.q[j] + s * (h * a.qd[j] + s * (c2 + s * c3));
    state.qd[i] = a.qd[j] + s * (2.0 * c2 + 3.0 * s * c3) / h;
  }
  return state;
}

struct Tip {
  Vector3 p_WT, v_WT_W;
};

Tip tip_of(const kinematics::ArmKinematics& arm, const Between& joints) {
  kinematics::Jacobian J_W;
  const Pose X_WT = arm.tip_in_world(joints.q, J_W);
  return {X_WT.translation(), J_W.topRows<3>() * joints.qd};
}

double direction_error(const Vector3& v, const Vector2& direction) {
  return std::abs(std::atan2(direction.x() * v.y() - direction.y() * v.x(), direction.dot(v.head<2>())));
}

void measure_joints(const kinematics::ArmKinematics& arm, const motion::MotionSettings& settings, const Trajectory& trajectory,
                    const Before* before, StrokeAudit& audit) {
  const double h = to_seconds(trajectory.tick);
  const std::size_t n = trajectory.size;
  for (int i = 0; i < trajectory.joints; ++i) {
    const auto j = static_cast<std::size_t>(i);
    // At rest before and after.
    const double qd_before = before != nullptr ? before->trajectory.points[before->tick - 1].qd[j] : 0.0;
    const auto qd = [&](std::size_t k) { return k == 0 ? qd_before : k <= n ? trajectory.points[k - 1].qd[j] : 0.0; };
    for (std::size_t k = 0; k < n; ++k) {
      const double last = qd(k);
      const double now = qd(k + 1);
      const double next = qd(k + 2);
      audit.speed = std::max(audit.speed, std::abs(now) / arm.max_speed()[i]);
      audit.acceleration = std::max(audit.acceleration, std::abs(next - now) / (h * settings.max_acceleration));
      audit.jerk = std::max(audit.jerk, std::abs(next - 2.0 * now + last) / (h * h * settings.max_jerk));
    }
    for (std::size_t k = 1; k < n; ++k) {
      const double way = trajectory.points[k].q[j] - trajectory.points[k - 1].q[j];
      // Within a tick a speed may bulge by no more than the jerk lets it.
      const double bulge = settings.max_jerk * h * h / 12.0;
      const double off = std::abs(way / h - 0.5 * (trajectory.points[k].qd[j] + trajectory.points[k - 1].qd[j]));
      audit.join = std::max(audit.join, off - bulge);
    }
    for (const std::size_t k : {std::size_t{0}, n - 1}) {
      const TrajectoryPoint& here = trajectory.points[k];
      const TrajectoryPoint there =
          k == 0 && before != nullptr ? before->trajectory.points[before->tick] : TrajectoryPoint{here.q, {}, {}, here.phase};
      const double off =
          std::max({std::abs(here.q[j] - there.q[j]), std::abs(here.qd[j] - there.qd[j]), std::abs(here.qdd[j] - there.qdd[j])});
      if (off > (k == 0 && before != nullptr ? kRounding : 0.0)) audit.at_rest_at_ends = false;
    }
  }
}

}  // namespace

StrokeAudit audit(const motion::StrokePlanner& planner, const StrokeRequest& request, const motion::StrokeTimes& times,
                  const Trajectory& trajectory, const Before* before) {
  StrokeAudit audit;
  const kinematics::ArmKinematics& arm = planner.kinematics();
  const motion::MotionSettings& settings = planner.settings();
  measure_joints(arm, settings, trajectory, before, audit);

  const bool hit = request.kind == StrokeKind::kHit;
  const bool push = request.kind == StrokeKind::kPush;
  const double h = to_seconds(trajectory.tick);
  const double line_end = push ? request.length : 0.0;
  audit.lowest_tip = audit.lowest_link = audit.struck_disc_gap = std::numeric_limits<double>::infinity();
  double fastest = 0.0;
  double push_end = 0.0;
  StrokePhase phase = StrokePhase::kTransit;
  for (std::size_t k = 0; k + 1 < trajectory.size; ++k) {
    const TrajectoryPoint& now = trajectory.points[k];
    if (now.phase < phase) audit.phases_in_order = false;
    phase = now.phase;
    for (int s = 0; s < kSamples; ++s) {
      const Between joints = hermite(now, trajectory.points[k + 1], trajectory.joints, h, static_cast<double>(s) / kSamples);
      audit.range = std::max({audit.range, (joints.q - arm.upper()).maxCoeff(), (arm.lower() - joints.q).maxCoeff()});
      audit.speed = std::max(audit.speed, (joints.qd.array() / arm.max_speed().array()).abs().maxCoeff());
      const motion::ArmClearance::Heights heights = planner.clearance().heights(joints.q);
      audit.lowest_tip = std::min(audit.lowest_tip, heights.tip);
      audit.lowest_link = std::min(audit.lowest_link, heights.links);
      if (!hit && !push) continue;

      const Tip tip = tip_of(arm, joints);
      const Vector2 from_point = tip.p_WT.head<2>() - request.p_WS;
      const double along = from_point.dot(request.direction_W);
      const double aside = std::abs(from_point.dot(perpendicular(request.direction_W)));
      const bool at_contact = k == trajectory.contact_tick && s == 0;
      if (at_contact) {
        audit.position_error = from_point.norm();
        audit.height_error = std::abs(tip.p_WT.z() - settings.tip_height);
        if (hit) {
          audit.direction_error = direction_error(tip.v_WT_W, request.direction_W);
          audit.speed_error = std::abs(tip.v_WT_W.head<2>().norm() / request.speed - 1.0);
        }
      }
      const bool on_line = now.phase == StrokePhase::kRunIn;
      if (on_line) {
        audit.line_deviation = std::max(audit.line_deviation, aside);
        audit.run_in_height = std::max(audit.run_in_height, tip.p_WT.z() - settings.tip_height);
      }
      if (on_line && push) {
        fastest = std::max(fastest, tip.v_WT_W.head<2>().norm());
        push_end = std::max(push_end, along);
        if (tip.v_WT_W.head<2>().norm() > kMoving) {
          audit.direction_error = std::max(audit.direction_error, direction_error(tip.v_WT_W, request.direction_W));
        }
      }
      if (heights.tip < settings.disc_height) {
        audit.corridor_breach = std::max({audit.corridor_breach, aside, -times.low_before - along, along - times.low_after - line_end});
      }
      // Whatever is lower than the transits' height must belong to the dip, which is straight as seen from above.
      if (aside > 3e-4) audit.low_outside_dip = std::max(audit.low_outside_dip, settings.safe_height() - heights.tip);
      if (hit && k > trajectory.contact_tick && heights.tip < settings.disc_height) {
        const double t = (static_cast<double>(k - trajectory.contact_tick) + static_cast<double>(s) / kSamples) * h;
        const double v = kDiscSpeedGain * request.speed;
        const double sliding = std::min(t, v / (kDiscFriction * kGravity));
        const double disc = kDiscRadius + settings.striker_radius + v * sliding - 0.5 * kDiscFriction * kGravity * sliding * sliding;
        const double gap = (disc * request.direction_W - from_point).norm() - kDiscRadius - settings.striker_radius;
        audit.struck_disc_gap = std::min(audit.struck_disc_gap, gap);
      }
    }
  }
  if (push) {
    audit.speed_error = std::abs(fastest / request.speed - 1.0);
    audit.end_error = std::abs(push_end - request.length);
  }
  if (!hit) audit.struck_disc_gap = 0.0;
  return audit;
}

StrokeRequest random_hit(SplitMix64& random, const Rect& area, double speed) {
  StrokeRequest request;
  request.kind = StrokeKind::kHit;
  request.p_WS = {random.uniform(area.min.x(), area.max.x()), random.uniform(area.min.y(), area.max.y())};
  const double bearing = random.uniform(-std::numbers::pi, std::numbers::pi);
  request.direction_W = {std::cos(bearing), std::sin(bearing)};
  request.speed = speed;
  request.run_in = random.uniform(0.0, 0.05);
  return request;
}

StrokeRequest random_push(SplitMix64& random, const Rect& area) {
  StrokeRequest request;
  do {
    request = random_hit(random, area, random.uniform(0.05, 0.3));
    request.kind = StrokeKind::kPush;
    request.length = random.uniform(0.03, 0.25);
  } while (!area.contains(request.p_WS + request.length * request.direction_W));
  return request;
}

}  // namespace breakshot::support
