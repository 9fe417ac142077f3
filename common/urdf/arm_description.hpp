#pragma once

#include "common/geometry.hpp"

#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace breakshot {

/// A primitive solid in a link frame L.
struct Shape {
  enum class Kind { kBox, kCylinder, kSphere };
  Kind kind = Kind::kBox;
  /// Box: full edge lengths. Cylinder: (radius, length along its z, 0). Sphere: (radius, 0, 0). m
  Vector3 size{Vector3::Zero()};
  Pose X_LS{Pose::Identity()};
  std::array<float, 3> rgb{0.5F, 0.5F, 0.5F};
};

/// A rigid link; links joined by fixed joints are merged into the one that moves them.
struct LinkDescription {
  std::string name;
  double mass = 0.0;                 ///< kg
  Vector3 p_LCom{Vector3::Zero()};   ///< centre of mass in L, m
  Matrix3 I_Com_L{Matrix3::Zero()};  ///< rotational inertia about the centre of mass, axes of L, kg m^2
  std::vector<Shape> visuals;
  std::vector<Shape> collisions;
};

/// A revolute joint between link i-1 (or the base) and link i.
struct JointDescription {
  std::string name;
  Pose X_PL{Pose::Identity()};       ///< pose of the child link's frame in its parent's at q = 0
  Vector3 axis_L{Vector3::UnitZ()};  ///< unit axis in the child's frame
  double lower = 0.0, upper = 0.0;   ///< rad
  double max_speed = 0.0;            ///< rad/s, > 0
  double max_torque = 0.0;           ///< N m, > 0
};

/// A serial arm of revolute joints, read from a URDF. joints[i] moves links[i].
struct ArmDescription {
  std::string name;
  LinkDescription base;
  std::vector<JointDescription> joints;
  std::vector<LinkDescription> links;
  Pose X_LT{Pose::Identity()};  ///< striker tip in the last link's frame
};

/// Says file, element (with its line where the parser knows it), what was found and what is allowed.
class ArmDescriptionError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads the chain from `base_link` to `tip_link`.
///
/// Supported are 1 to kMaxJoints revolute joints and any number of fixed ones; every joint needs limits with lower < upper, and speed and
/// effort above zero; every moving link needs a mass above zero and a positive definite inertia.
/// @throws ArmDescriptionError for all that is missing, malformed or not supported
ArmDescription load_arm(const std::filesystem::path& urdf, const std::string& base_link, const std::string& tip_link);
/// As load_arm(), from a text; `name` stands for the file in errors.
ArmDescription parse_arm(const std::string& text, const std::filesystem::path& name, const std::string& base_link,
                         const std::string& tip_link);

}  // namespace breakshot
