#include "common/urdf/arm_description.hpp"

#include "common/joints.hpp"
#include "common/urdf/urdf_lines.hpp"

#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

namespace breakshot {
namespace {

using urdf_detail::UrdfLines;

[[noreturn]] void refuse(const std::string& place, const std::string& what, const std::string& found, const std::string& allowed) {
  throw ArmDescriptionError{place + ": " + what + ": found " + found + "; allowed: " + allowed};
}

/// Collects what urdfdom would print, so that its reasons reach the error instead of the terminal.
class CapturedMessages final : public console_bridge::OutputHandler {
 public:
  CapturedMessages() { console_bridge::useOutputHandler(this); }
  ~CapturedMessages() override { console_bridge::restorePreviousOutputHandler(); }
  CapturedMessages(const CapturedMessages&) = delete;
  CapturedMessages& operator=(const CapturedMessages&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char* /*file*/, int /*line*/) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) text_ += (text_.empty() ? "" : "; ") + text;
  }
  const std::string& text() const noexcept { return text_; }

 private:
  std::string text_;
};

std::string read_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) refuse(path.string(), "arm", "no such file", "a URDF file");
  std::ifstream stream{path, std::ios::binary};
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream || text.str().empty()) refuse(path.string(), "arm", "an empty or unreadable file", "a URDF file");
  return text.str();
}

urdf::ModelInterfaceSharedPtr parse(const std::string& text, const UrdfLines& lines) {
  const CapturedMessages messages;
  std::string reason;
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(text);
  } catch (const std::exception& error) {
    reason = error.what();
  }
  if (!messages.text().empty()) reason += (reason.empty() ? "" : "; ") + messages.text();
  // urdfdom reports some faults and goes on with a default; an arm with a default in a wrong place is not the arm that was meant.
  if (!model || !reason.empty()) refuse(lines.mentioned(reason), "urdfdom", reason, "a valid URDF");
  return model;
}

Vector3 to_eigen(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Pose to_eigen(const urdf::Pose& pose) {
  Eigen::Quaterniond q;
  pose.rotation.getQuaternion(q.x(), q.y(), q.z(), q.w());
  Pose X{Pose::Identity()};
  X.linear() = q.normalized().toRotationMatrix();
  X.translation() = to_eigen(pose.position);
  return X;
}

/// Adds a rigid body to a link: the common centre of mass, and both inertias moved there (Huygens-Steiner).
void add_inertia(LinkDescription& link, double mass, const Vector3& p_LCom, const Matrix3& I_Com_L) {
  const auto shift = [](double m, const Vector3& r) -> Matrix3 { return m * (r.squaredNorm() * Matrix3::Identity() - r * r.transpose()); };
  const double total = link.mass + mass;
  if (total <= 0.0) return;
  const Vector3 p_common = (link.mass * link.p_LCom + mass * p_LCom) / total;
  link.I_Com_L += shift(link.mass, link.p_LCom - p_common) + I_Com_L + shift(mass, p_LCom - p_common);
  link.p_LCom = p_common;
  link.mass = total;
}

Shape to_shape(const urdf::GeometrySharedPtr& geometry, const Pose& X_LS, const std::string& place, const std::string& what) {
  Shape shape;
  shape.X_LS = X_LS;
  if (!geometry) refuse(place, what, "no geometry", "a box, cylinder or sphere");
  switch (geometry->type) {
    case urdf::Geometry::BOX:
      shape.kind = Shape::Kind::kBox;
      shape.size = to_eigen(static_cast<const urdf::Box&>(*geometry).dim);
      break;
    case urdf::Geometry::CYLINDER: {
      const auto& cylinder = static_cast<const urdf::Cylinder&>(*geometry);
      shape.kind = Shape::Kind::kCylinder;
      shape.size = {cylinder.radius, cylinder.length, 0.0};
      break;
    }
    case urdf::Geometry::SPHERE:
      shape.kind = Shape::Kind::kSphere;
      shape.size = {static_cast<const urdf::Sphere&>(*geometry).radius, 0.0, 0.0};
      break;
    case urdf::Geometry::MESH: refuse(place, what, "a mesh", "a box, cylinder or sphere; the simulator collides primitives only");
  }
  const Eigen::Index used = shape.kind == Shape::Kind::kBox ? 3 : shape.kind == Shape::Kind::kCylinder ? 2 : 1;
  if (!(shape.size.head(used).array() > 0.0).all() || !shape.size.allFinite()) {
    refuse(place, what, "a size that is not above zero", "sizes above zero, m");
  }
  return shape;
}

/// Builds the description while walking the tree of links.
class ArmBuilder {
 public:
  ArmBuilder(const urdf::ModelInterface& model, const UrdfLines& lines) : model_{model}, lines_{lines} {}

  ArmDescription build(const std::string& base_link, const std::string& tip_link) {
    find_chain(base_link, tip_link);
    arm_.name = model_.getName();
    Exit exit;
    arm_.base = gather(base_link, exit);
    while (exit.joint != nullptr) {
      if (arm_.joints.size() == static_cast<std::size_t>(kMaxJoints)) {
        refuse(lines_.joint(exit.joint->name), "joint " + exit.joint->name, "one more moving joint than the arm may have",
               "at most " + std::to_string(kMaxJoints));
      }
      arm_.joints.push_back(to_joint(*exit.joint, exit.X_LF));
      arm_.links.push_back(gather(exit.joint->child_link_name, exit));
      check_inertia(arm_.links.back());
    }
    if (arm_.joints.empty()) {
      refuse(lines_.link(tip_link), "link " + tip_link, "no revolute joint between it and " + base_link,
             "1 to " + std::to_string(kMaxJoints) + " revolute joints");
    }
    return std::move(arm_);
  }

 private:
  /// The moving joint by which the chain leaves a body; none for the last body.
  struct Exit {
    const urdf::Joint* joint = nullptr;
    Pose X_LF{Pose::Identity()};  ///< of the URDF link that the joint hangs on, in the body's frame L
  };

  /// Links from the tip up to the base.
  void find_chain(const std::string& base_link, const std::string& tip_link) {
    for (const std::string& name : {base_link, tip_link}) {
      if (model_.getLink(name)) continue;
      std::string known;
      for (const std::string& link : lines_.link_names()) known += (known.empty() ? "" : ", ") + link;
      refuse(lines_.file(), "link " + name, "no such link", known);
    }
    for (auto link = model_.getLink(tip_link); link; link = link->getParent()) {
      chain_.push_back(link->name);
      if (link->name == base_link) return;
    }
    refuse(lines_.link(tip_link), "link " + tip_link, "no chain of joints to it from " + base_link, "a tip that hangs on the base");
  }

  bool on_chain(const std::string& link) const { return std::find(chain_.begin(), chain_.end(), link) != chain_.end(); }

  /// The rigid body of a URDF link and all that is fixed to it.
  LinkDescription gather(const std::string& root, Exit& exit) {
    LinkDescription body;
    body.name = root;
    exit = {};
    std::vector<std::pair<std::string, Pose>> open{{root, Pose::Identity()}};
    while (!open.empty()) {
      const auto [name, X_LF] = open.back();
      open.pop_back();
      const auto link = model_.getLink(name);
      add_solids(body, *link, X_LF);
      if (name == chain_.front()) arm_.X_LT = X_LF;
      for (const auto& joint : link->child_joints) {
        if (joint->type == urdf::Joint::FIXED) {
          open.emplace_back(joint->child_link_name, X_LF * to_eigen(joint->parent_to_joint_origin_transform));
        } else if (on_chain(joint->child_link_name)) {
          exit = {joint.get(), X_LF};
        } else {
          refuse(lines_.joint(joint->name), "joint " + joint->name, "a moving joint off the chain to " + chain_.front(),
                 "moving joints on the chain only; make it fixed, or leave it out");
        }
      }
    }
    return body;
  }

  void add_solids(LinkDescription& body, const urdf::Link& link, const Pose& X_LF) const {
    const std::string place = lines_.link(link.name);
    const std::string what = "link " + link.name;
    if (const auto& inertial = link.inertial) {
      if (!(inertial->mass >= 0.0) || !std::isfinite(inertial->mass)) refuse(place, what, "a mass below zero", "a mass of at least 0 kg");
      Matrix3 I_Com;
      I_Com << inertial->ixx, inertial->ixy, inertial->ixz,  //
          inertial->ixy, inertial->iyy, inertial->iyz,       //
          inertial->ixz, inertial->iyz, inertial->izz;
      const Pose X_LI = X_LF * to_eigen(inertial->origin);
      add_inertia(body, inertial->mass, X_LI.translation(), X_LI.linear() * I_Com * X_LI.linear().transpose());
    }
    for (const auto& visual : link.visual_array) {
      Shape shape = to_shape(visual->geometry, X_LF * to_eigen(visual->origin), place, what + ", visual");
      if (visual->material) shape.rgb = {visual->material->color.r, visual->material->color.g, visual->material->color.b};
      body.visuals.push_back(shape);
    }
    for (const auto& collision : link.collision_array) {
      body.collisions.push_back(to_shape(collision->geometry, X_LF * to_eigen(collision->origin), place, what + ", collision"));
    }
  }

  JointDescription to_joint(const urdf::Joint& joint, const Pose& X_LF) const {
    const std::string place = lines_.joint(joint.name);
    const std::string what = "joint " + joint.name;
    const std::string allowed = "revolute and fixed joints";
    switch (joint.type) {
      case urdf::Joint::REVOLUTE: break;
      case urdf::Joint::CONTINUOUS: refuse(place, what, "a continuous joint, which has no limits", "type \"revolute\" with a <limit>");
      case urdf::Joint::PRISMATIC: refuse(place, what, "a prismatic joint; drives and kinematics here only turn", allowed);
      case urdf::Joint::FLOATING: refuse(place, what, "a floating joint, which no drive moves", allowed);
      case urdf::Joint::PLANAR: refuse(place, what, "a planar joint, which no drive moves", allowed);
      default: refuse(place, what, "a joint of unknown type", allowed);
    }
    if (joint.mimic) {
      refuse(place, what, "a joint that mimics " + joint.mimic->joint_name + "; every joint has a drive of its own", "no <mimic>");
    }
    if (!joint.limits) refuse(place, what, "no <limit>", "lower, upper, velocity and effort");
    JointDescription description;
    description.name = joint.name;
    description.X_PL = X_LF * to_eigen(joint.parent_to_joint_origin_transform);
    description.lower = joint.limits->lower;
    description.upper = joint.limits->upper;
    description.max_speed = joint.limits->velocity;
    description.max_torque = joint.limits->effort;
    const std::string at = lines_.limit(joint.name);
    const auto number = [](double value) { return std::to_string(value); };
    if (!(description.lower < description.upper) || !std::isfinite(description.lower) || !std::isfinite(description.upper)) {
      refuse(at, what, "lower " + number(description.lower) + " and upper " + number(description.upper), "lower < upper, rad");
    }
    if (!(description.max_speed > 0.0) || !std::isfinite(description.max_speed)) {
      refuse(at, what, "velocity " + number(description.max_speed), "a speed above zero, rad/s");
    }
    if (!(description.max_torque > 0.0) || !std::isfinite(description.max_torque)) {
      refuse(at, what, "effort " + number(description.max_torque), "a torque above zero, N m");
    }
    description.axis_L = to_eigen(joint.axis);
    if (!(description.axis_L.norm() > 1e-6)) refuse(place, what, "an axis of length zero", "a direction");
    description.axis_L.normalize();
    return description;
  }

  void check_inertia(const LinkDescription& link) const {
    const std::string place = lines_.link(link.name);
    const std::string what = "link " + link.name;
    if (!(link.mass > 0.0)) refuse(place, what, "no mass, with all that is fixed to it", "an <inertial> with a mass above zero");
    if (!link.I_Com_L.allFinite()) refuse(place, what, "an inertia that is not finite", "finite numbers");
    const Vector3 principal = Eigen::SelfAdjointEigenSolver<Matrix3>{link.I_Com_L, Eigen::EigenvaluesOnly}.eigenvalues();
    if (!(principal[0] > 0.0)) {
      refuse(place, what,
             "an inertia that is not positive definite (smallest principal moment " + std::to_string(principal[0]) + " kg m^2)",
             "principal moments above zero");
    }
    // No body has a principal moment above the sum of the two others; 1e-6 is rounding in the file.
    if (principal[2] > (principal[0] + principal[1]) * (1.0 + 1e-6)) {
      refuse(place, what, "an inertia that no body has: the largest principal moment exceeds the sum of the two others",
             "the inertia of a real body");
    }
  }

  const urdf::ModelInterface& model_;
  const UrdfLines& lines_;
  ArmDescription arm_;
  std::vector<std::string> chain_;  ///< names of the links from tip to base
};

}  // namespace

ArmDescription load_arm(const std::filesystem::path& urdf, const std::string& base_link, const std::string& tip_link) {
  return parse_arm(read_file(urdf), urdf, base_link, tip_link);
}

ArmDescription parse_arm(const std::string& text, const std::filesystem::path& name, const std::string& base_link,
                         const std::string& tip_link) {
  const UrdfLines lines{text, name.string()};
  return ArmBuilder{*parse(text, lines), lines}.build(base_link, tip_link);
}

}  // namespace breakshot
