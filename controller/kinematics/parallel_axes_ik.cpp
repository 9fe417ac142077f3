#include "controller/kinematics/parallel_axes_ik.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::kinematics {
namespace {

/// How far from parallel (rad) or meeting (m) axes may be. URDFs round angles to 1e-9 or so; calibrated arms are off by 1e-4 and do not qualify.
constexpr double kGeometryTolerance = 1e-6;
/// How far beyond its workspace a pose may seem to lie by rounding, relative. At the border a branch pair merges into one.
constexpr double kBorderTolerance = 1e-9;

struct Angles {
  std::array<double, 2> value{};
  int size = 0;
};

/// All x with a cos x + b sin x = c.
Angles solve_trigonometric(double a, double b, double c) noexcept {
  const double r = std::hypot(a, b);
  if (r < 1e-12 || std::abs(c) > r * (1.0 + kBorderTolerance)) return {};
  const double middle = std::atan2(b, a);
  const double half = std::acos(std::clamp(c / r, -1.0, 1.0));
  if (half < 1e-12) return {{middle, 0.0}, 1};
  return {{middle + half, middle - half}, 2};
}

Vector3 turn(const Vector3& axis, double angle, const Vector3& v) noexcept {  // Rodrigues
  const double c = std::cos(angle);
  return c * v + std::sin(angle) * axis.cross(v) + (1.0 - c) * axis.dot(v) * axis;
}

Vector3 across(const Vector3& axis, const Vector3& v) noexcept { return v - axis.dot(v) * axis; }

/// Angle about the axis that takes `from` to `to`, both seen along the axis.
double angle_about(const Vector3& axis, const Vector3& from, const Vector3& to) noexcept {
  const Vector3 a = across(axis, from);
  const Vector3 b = across(axis, to);
  return std::atan2(axis.dot(a.cross(b)), a.dot(b));
}

double wrapped(double angle) noexcept { return std::remainder(angle, 2.0 * std::numbers::pi); }

}  // namespace

std::optional<ParallelAxesIk> ParallelAxesIk::recognise(const ArmKinematics& arm) {
  if (arm.joints() != 6) return std::nullopt;
  ParallelAxesIk ik;
  const JointVector home = JointVector::Zero(6);
  KDL::Frame X = arm.chain().getSegment(0).pose(0.0);
  for (unsigned i = 0; i < 6; ++i) {
    const KDL::Vector z = X.M.UnitZ();
    ik.axes_[i] = {Vector3{X.p.x(), X.p.y(), X.p.z()}, Vector3{z.x(), z.y(), z.z()}.normalized()};
    X = X * arm.chain().getSegment(i + 1).pose(0.0);
  }
  const Vector3 n = ik.axes_[1].direction;
  const Vector3 z3 = ik.axes_[2].direction;
  const Vector3 z4 = ik.axes_[3].direction;
  const Vector3 z5 = ik.axes_[4].direction;
  const Vector3 z6 = ik.axes_[5].direction;
  const auto parallel = [](const Vector3& a, const Vector3& b) { return a.cross(b).norm() < kGeometryTolerance; };
  if (!parallel(n, z3) || !parallel(n, z4)) return std::nullopt;
  if (parallel(n, ik.axes_[0].direction) || parallel(n, z5) || parallel(z5, z6)) return std::nullopt;
  const double upper_arm = across(n, ik.axes_[2].point - ik.axes_[1].point).norm();
  const double forearm = across(n, ik.axes_[3].point - ik.axes_[2].point).norm();
  if (upper_arm < kGeometryTolerance || forearm < kGeometryTolerance) return std::nullopt;

  // Where axes 5 and 6 come closest.
  const Vector3 p56 = ik.axes_[5].point - ik.axes_[4].point;
  const double c = z5.dot(z6);
  const double along5 = (p56.dot(z5) - c * p56.dot(z6)) / (1.0 - c * c);
  const Vector3 on5 = ik.axes_[4].point + along5 * z5;
  const Vector3 on6 = ik.axes_[5].point + (c * along5 - p56.dot(z6)) * z6;
  if ((on5 - on6).norm() > kGeometryTolerance) return std::nullopt;

  ik.sign3_ = n.dot(z3) > 0.0 ? 1.0 : -1.0;
  ik.sign4_ = n.dot(z4) > 0.0 ? 1.0 : -1.0;
  ik.meeting_ = on5;
  const Pose X_BT = arm.tip_in_base(home);
  ik.p_TP_ = X_BT.inverse() * on5;
  ik.R_home_ = X_BT.linear();
  return ik;
}

Branches ParallelAxesIk::solve(const Pose& X_BT, double q6_if_free) const noexcept {
  Branches branches;
  const Vector3& z1 = axes_[0].direction;
  const Vector3& n = axes_[1].direction;
  const Vector3& z5 = axes_[4].direction;
  const Vector3& z6 = axes_[5].direction;
  const Vector3& o1 = axes_[0].point;
  const Vector3 arm_to_P = X_BT * p_TP_ - o1;

  // n turned by q1 about axis 1 keeps its dot product with P.
  const Vector3 n_across = across(z1, n);
  const Angles q1s =
      solve_trigonometric(n_across.dot(arm_to_P), z1.cross(n_across).dot(arm_to_P), n.dot(meeting_ - o1) - z1.dot(n) * z1.dot(arm_to_P));
  const Matrix3 R_target = X_BT.linear() * R_home_.transpose();
  for (int i1 = 0; i1 < q1s.size; ++i1) {
    const double q1 = q1s.value[static_cast<std::size_t>(i1)];
    const Matrix3 M = Eigen::AngleAxisd{-q1, z1}.toRotationMatrix() * R_target;  // = Rot(n, q234) Rot(z5, q5) Rot(z6, q6)
    const Vector3 P = turn(z1, -q1, arm_to_P) + o1;

    const Vector3 z6_across5 = across(z5, z6);
    const Angles q5s = solve_trigonometric(n.dot(z6_across5), n.dot(z5.cross(z6)), n.dot(M * z6) - n.dot(z5) * z5.dot(z6));
    for (int i5 = 0; i5 < q5s.size; ++i5) {
      const double q5 = q5s.value[static_cast<std::size_t>(i5)];
      const Vector3 n_seen_from_6 = turn(z5, -q5, n);
      const bool free6 = across(z6, n_seen_from_6).norm() < 1e-9;
      const double q6 = free6 ? q6_if_free : -angle_about(z6, n_seen_from_6, M.transpose() * n);
      const Matrix3 turn234 = M * Eigen::AngleAxisd{-q6, z6}.toRotationMatrix() * Eigen::AngleAxisd{-q5, z5}.toRotationMatrix();
      const Vector3 any_across = n.unitOrthogonal();
      const double q234 = angle_about(n, any_across, turn234 * any_across);

      // The planar arm: from axis 2 over axis 3 to axis 4, all seen along n.
      const Vector3 p4 = P - turn(n, q234, meeting_ - axes_[3].point);
      const Vector3 target = across(n, p4 - axes_[1].point);
      const Vector3 upper = across(n, axes_[2].point - axes_[1].point);
      const Vector3 fore = across(n, axes_[3].point - axes_[2].point);
      const Angles elbow = solve_trigonometric(2.0 * upper.dot(fore), 2.0 * upper.dot(n.cross(fore)),
                                               target.squaredNorm() - upper.squaredNorm() - fore.squaredNorm());
      for (int i3 = 0; i3 < elbow.size; ++i3) {
        const double turn3 = elbow.value[static_cast<std::size_t>(i3)];
        const double q2 = angle_about(n, upper + turn(n, turn3, fore), target);
        JointVector& q = branches.q[branches.size++];
        q.resize(6);
        q << wrapped(q1), wrapped(q2), wrapped(sign3_ * turn3), wrapped(sign4_ * (q234 - q2 - turn3)), wrapped(q5), wrapped(q6);
      }
    }
  }
  return branches;
}

}  // namespace breakshot::kinematics
