#include "controller/kinematics/closed_form.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot::kinematics {
namespace {

/// How far beyond its workspace a pose may seem to lie by rounding, relative. At the border a branch pair merges into one.
constexpr double kBorderTolerance = 1e-9;

}  // namespace

std::array<Axis, 6> home_axes(const ArmKinematics& arm) {
  std::array<Axis, 6> axes;
  KDL::Frame X = arm.chain().getSegment(0).pose(0.0);
  for (unsigned i = 0; i < 6; ++i) {
    const KDL::Vector z = X.M.UnitZ();
    axes[i] = {Vector3{X.p.x(), X.p.y(), X.p.z()}, Vector3{z.x(), z.y(), z.z()}.normalized()};
    X = X * arm.chain().getSegment(i + 1).pose(0.0);
  }
  return axes;
}

bool parallel(const Vector3& a, const Vector3& b) noexcept { return a.cross(b).norm() < kGeometryTolerance; }

std::optional<Vector3> meeting_point(const Axis& a, const Axis& b) noexcept {
  // Where they come closest.
  const Vector3 p_ab = b.point - a.point;
  const double c = a.direction.dot(b.direction);
  const double along_a = (p_ab.dot(a.direction) - c * p_ab.dot(b.direction)) / (1.0 - c * c);
  const Vector3 on_a = a.point + along_a * a.direction;
  const Vector3 on_b = b.point + (c * along_a - p_ab.dot(b.direction)) * b.direction;
  if (!((on_a - on_b).norm() <= kGeometryTolerance)) return std::nullopt;
  return on_a;
}

Angles solve_trigonometric(double a, double b, double c) noexcept {
  const double r = std::hypot(a, b);
  if (r < 1e-12 || std::abs(c) > r * (1.0 + kBorderTolerance)) return {};
  const double middle = std::atan2(b, a);
  const double half = std::acos(std::clamp(c / r, -1.0, 1.0));
  if (half < 1e-12) return {{middle, 0.0}, 1};
  return {{middle + half, middle - half}, 2};
}

Angles turns_to_product(const Vector3& axis, const Vector3& from, const Vector3& to, double c) noexcept {
  const Vector3 from_across = across(axis, from);
  return solve_trigonometric(to.dot(from_across), to.dot(axis.cross(from)), c - to.dot(axis) * axis.dot(from));
}

Vector3 turn(const Vector3& axis, double angle, const Vector3& v) noexcept {
  const double c = std::cos(angle);
  return c * v + std::sin(angle) * axis.cross(v) + (1.0 - c) * axis.dot(v) * axis;
}

double angle_about(const Vector3& axis, const Vector3& from, const Vector3& to) noexcept {
  const Vector3 a = across(axis, from);
  const Vector3 b = across(axis, to);
  return std::atan2(axis.dot(a.cross(b)), a.dot(b));
}

double wrapped(double angle) noexcept {  // sums of a few angles: subtracting is several times as fast as std::remainder
  constexpr double turn = 2.0 * std::numbers::pi;
  while (angle > std::numbers::pi) angle -= turn;
  while (angle < -std::numbers::pi) angle += turn;
  return angle;
}

}  // namespace breakshot::kinematics
