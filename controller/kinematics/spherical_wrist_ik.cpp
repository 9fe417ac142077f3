#include "controller/kinematics/spherical_wrist_ik.hpp"

namespace breakshot::kinematics {

std::optional<SphericalWristIk> SphericalWristIk::recognise(const ArmKinematics& arm) {
  if (arm.joints() != 6) return std::nullopt;
  SphericalWristIk ik;
  ik.axes_ = home_axes(arm);
  const Vector3& n = ik.axes_[1].direction;
  if (!parallel(n, ik.axes_[2].direction) || parallel(n, ik.axes_[0].direction)) return std::nullopt;
  if (parallel(ik.axes_[3].direction, ik.axes_[4].direction) || parallel(ik.axes_[4].direction, ik.axes_[5].direction)) return std::nullopt;
  const auto centre = meeting_point(ik.axes_[3], ik.axes_[4]);
  if (!centre || across(ik.axes_[5].direction, *centre - ik.axes_[5].point).norm() > kGeometryTolerance) return std::nullopt;
  const double upper_arm = across(n, ik.axes_[2].point - ik.axes_[1].point).norm();
  const double forearm = across(n, *centre - ik.axes_[2].point).norm();
  if (upper_arm < kGeometryTolerance || forearm < kGeometryTolerance) return std::nullopt;

  ik.sign3_ = n.dot(ik.axes_[2].direction) > 0.0 ? 1.0 : -1.0;
  ik.centre_ = *centre;
  const Pose X_BT = arm.tip_in_base(JointVector::Zero(6));
  ik.p_TP_ = X_BT.inverse() * *centre;
  ik.R_home_ = X_BT.linear();
  return ik;
}

Branches SphericalWristIk::solve(const Pose& X_BT, double q4_if_free) const noexcept {
  Branches branches;
  const Vector3& z1 = axes_[0].direction;
  const Vector3& n = axes_[1].direction;
  const Vector3& z4 = axes_[3].direction;
  const Vector3& z5 = axes_[4].direction;
  const Vector3& z6 = axes_[5].direction;
  const Vector3& o1 = axes_[0].point;
  const Vector3 arm_to_P = X_BT * p_TP_ - o1;
  const Matrix3 R_target = X_BT.linear() * R_home_.transpose();
  const Vector3 any_across = z6.unitOrthogonal();
  const Vector3 R_target_z6 = R_target * z6;
  const Vector3 R_target_across = R_target * any_across;
  const Vector3 upper = across(n, axes_[2].point - axes_[1].point);
  const Vector3 fore = across(n, centre_ - axes_[2].point);

  // n turned by q1 about axis 1 keeps its dot product with P.
  for (const double q1 : turns_to_product(z1, n, arm_to_P, n.dot(centre_ - o1))) {
    // The planar arm: from axis 2 over axis 3 to P, seen along n.
    const Vector3 target = across(n, turn(z1, -q1, arm_to_P) + o1 - axes_[1].point);
    const Angles elbow = solve_trigonometric(2.0 * upper.dot(fore), 2.0 * upper.dot(n.cross(fore)),
                                             target.squaredNorm() - upper.squaredNorm() - fore.squaredNorm());
    for (const double turn3 : elbow) {
      const double q2 = angle_about(n, upper + turn(n, turn3, fore), target);
      // What is left of the rotation, M = Rot(z4, q4) Rot(z5, q5) Rot(z6, q6), is seen on z6 and on any vector across it.
      const auto M = [&](const Vector3& v_target) { return turn(n, -q2 - turn3, turn(z1, -q1, v_target)); };
      const Vector3 M_z6 = M(R_target_z6);
      const Vector3 M_across = M(R_target_across);
      for (const double q5 : turns_to_product(z5, z6, z4, z4.dot(M_z6))) {
        const Vector3 z6_after5 = turn(z5, q5, z6);
        const bool free4 = across(z4, z6_after5).norm() < kTogether;
        const double q4 = free4 ? q4_if_free : angle_about(z4, z6_after5, M_z6);
        const double q6 = angle_about(z6, any_across, turn(z5, -q5, turn(z4, -q4, M_across)));
        JointVector& q = branches.q[branches.size++];
        q.resize(6);
        q << wrapped(q1), wrapped(q2), wrapped(sign3_ * turn3), wrapped(q4), wrapped(q5), wrapped(q6);
      }
    }
  }
  return branches;
}

}  // namespace breakshot::kinematics
