#pragma once

#include "common/geometry.hpp"
#include "common/joints.hpp"
#include "controller/kinematics/arm_kinematics.hpp"

#include <array>
#include <cstddef>
#include <optional>

/// What the closed forms share: joint axes as lines in space, and the few equations of turns that they all come down to.
namespace breakshot::kinematics {

/// Most branches of a six-joint arm of the classes here: shoulder, elbow and wrist, two ways each.
inline constexpr std::size_t kMaxBranches = 8;

/// The joint vectors that put the tip in one pose.
struct Branches {
  std::array<JointVector, kMaxBranches> q;
  std::size_t size = 0;
};

/// How far from parallel (rad) or meeting (m) axes may be. URDFs round angles to 1e-9 or so; calibrated arms are off by 1e-4 and do not qualify.
inline constexpr double kGeometryTolerance = 1e-6;

/// Axes nearer than this to parallel fall together, and the joint between them is free, rad. Their angle comes from an arc cosine, which is
/// uncertain by 2e-8 there; an error of the pose of this size is the price.
inline constexpr double kTogether = 1e-7;

/// A joint's axis in B at q = 0.
struct Axis {
  Vector3 point, direction;  ///< m; unit
};

/// Axes of a six-joint arm.
std::array<Axis, 6> home_axes(const ArmKinematics& arm);

bool parallel(const Vector3& a, const Vector3& b) noexcept;
/// Where two axes that are not parallel meet; nothing when they pass each other.
std::optional<Vector3> meeting_point(const Axis& a, const Axis& b) noexcept;

/// No, one or two angles.
struct Angles {
  std::array<double, 2> value{};
  int size = 0;

  const double* begin() const noexcept { return value.data(); }
  const double* end() const noexcept { return value.data() + size; }
};

/// All x with a cos x + b sin x = c.
Angles solve_trigonometric(double a, double b, double c) noexcept;

/// All turns x about `axis` with  to . Rot(axis, x) from = c.
Angles turns_to_product(const Vector3& axis, const Vector3& from, const Vector3& to, double c) noexcept;

/// v turned about an axis (Rodrigues).
Vector3 turn(const Vector3& axis, double angle, const Vector3& v) noexcept;

/// The part of v across the axis.
inline Vector3 across(const Vector3& axis, const Vector3& v) noexcept { return v - axis.dot(v) * axis; }

/// Angle about the axis that takes `from` to `to`, both seen along the axis.
double angle_about(const Vector3& axis, const Vector3& from, const Vector3& to) noexcept;

/// Into [-pi, pi], from a few turns outside of it at most.
double wrapped(double angle) noexcept;

}  // namespace breakshot::kinematics
