#include "controller/kinematics/parallel_axes_ik.hpp"

namespace breakshot::kinematics {

std::optional<ParallelAxesIk> ParallelAxesIk::recognise(const ArmKinematics& arm) {
  if (arm.joints() != 6) return std::nullopt;
  ParallelAxesIk ik;
  ik.axes_ = home_axes(arm);
  const Vector3 n = ik.axes_[1].direction;
  const Vector3 z3 = ik.axes_[2].direction;
  const Vector3 z4 = ik.axes_[3].direction;
  const Vector3 z5 = ik.axes_[4].direction;
  const Vector3 z6 = ik.axes_[5].direction;
  if (!parallel(n, z3) || !parallel(n, z4)) return std::nullopt;
  if (parallel(n, ik.axes_[0].direction) || parallel(n, z5) || parallel(z5, z6)) return std::nullopt;
  const double upper_arm = across(n, ik.axes_[2].point - ik.axes_[1].point).norm();
  const double forearm = across(n, ik.axes_[3].point - ik.axes_[2].point).norm();
  if (upper_arm < kGeometryTolerance || forearm < kGeometryTolerance) return std::nullopt;

  const auto meeting = meeting_point(ik.axes_[4], ik.axes_[5]);
  if (!meeting) return std::nullopt;

  ik.sign3_ = n.dot(z3) > 0.0 ? 1.0 : -1.0;
  ik.sign4_ = n.dot(z4) > 0.0 ? 1.0 : -1.0;
  ik.meeting_ = *meeting;
  const Pose X_BT = arm.tip_in_base(JointVector::Zero(6));
  ik.p_TP_ = X_BT.inverse() * *meeting;
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
  const Vector3 any_across = n.unitOrthogonal();
  const Vector3 upper = across(n, axes_[2].point - axes_[1].point);
  const Vector3 fore = across(n, axes_[3].point - axes_[2].point);

  // n turned by q1 about axis 1 keeps its dot product with P.
  const Angles q1s = turns_to_product(z1, n, arm_to_P, n.dot(meeting_ - o1));
  const Matrix3 R_target = X_BT.linear() * R_home_.transpose();
  for (const double q1 : q1s) {
    const Matrix3 M = Eigen::AngleAxisd{-q1, z1}.toRotationMatrix() * R_target;  // = Rot(n, q234) Rot(z5, q5) Rot(z6, q6)
    const Vector3 P = turn(z1, -q1, arm_to_P) + o1;

    for (const double q5 : turns_to_product(z5, z6, n, n.dot(M * z6))) {
      const Vector3 n_seen_from_6 = turn(z5, -q5, n);
      const bool free6 = across(z6, n_seen_from_6).norm() < kTogether;
      const double q6 = free6 ? q6_if_free : -angle_about(z6, n_seen_from_6, M.transpose() * n);
      // Rot(n, q234) = M Rot(z6, -q6) Rot(z5, -q5), seen on any vector across n.
      const double q234 = angle_about(n, any_across, M * turn(z6, -q6, turn(z5, -q5, any_across)));

      // The planar arm: from axis 2 over axis 3 to axis 4, all seen along n.
      const Vector3 p4 = P - turn(n, q234, meeting_ - axes_[3].point);
      const Vector3 target = across(n, p4 - axes_[1].point);
      const Angles elbow = solve_trigonometric(2.0 * upper.dot(fore), 2.0 * upper.dot(n.cross(fore)),
                                               target.squaredNorm() - upper.squaredNorm() - fore.squaredNorm());
      for (const double turn3 : elbow) {
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
