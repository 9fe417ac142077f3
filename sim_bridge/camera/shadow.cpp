#include "sim_bridge/camera/shadow.hpp"

#include "sim_bridge/camera/table_patch.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace breakshot::sim_bridge {
namespace {

/// A disc darkens the table this many heights around its foot; the shader fades to nothing there.
constexpr double kOcclusionReach = 1.25;
/// Cells per side of a disc's patch, so that it follows a lens that bends it.
constexpr int kCellsDistorted = 3;

double smoothstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

Light::Light(const LightSettings& settings) : ambient{settings.ambient}, shadows{settings.shadows} {
  const double elevation = std::atan2(settings.towards_W.z(), settings.towards_W.head<2>().norm());
  if (!settings.towards_W.allFinite() || !(elevation > 0.17)) {
    throw CameraError{"camera: light.towards_W must point at least 10 degrees above the table"};
  }
  if (!(settings.angular_radius >= 0.0 && settings.angular_radius <= 0.5)) {
    throw CameraError{"camera: light.angular_radius in rad: found " + std::to_string(settings.angular_radius) + "; allowed 0 to 0.5"};
  }
  if (!(ambient >= 0.0 && ambient <= 1.0)) {
    throw CameraError{"camera: light.ambient: found " + std::to_string(ambient) + "; allowed 0 to 1"};
  }
  direction_W = settings.towards_W.normalized();
  tan_softness = std::tan(settings.angular_radius);
  const Vector3 across = direction_W.unitOrthogonal();
  axes_W << across, direction_W.cross(across), direction_W;
}

Capsule make_capsule(const Shape& shape) {
  Vector3 half = Vector3::Zero();  // half of the capsule's straight part, in S
  double radius = shape.size.x();
  switch (shape.kind) {
    case Shape::Kind::kSphere: break;
    case Shape::Kind::kCylinder: half.z() = std::max(0.0, 0.5 * shape.size.y() - 0.5 * radius); break;
    case Shape::Kind::kBox: {
      Eigen::Index longest = 0;
      const double length = shape.size.maxCoeff(&longest);
      radius = 0.25 * (shape.size.sum() - length);
      half[longest] = std::max(0.0, 0.5 * length - 0.5 * radius);
      break;
    }
  }
  return {shape.X_LS * Vector3{-half}, shape.X_LS * half, radius};
}

CapsuleShadow::CapsuleShadow(const Capsule& capsule_W, const Light& light)
    : start{light.axes_W.transpose() * capsule_W.start},
      along{light.axes_W.transpose() * (capsule_W.end - capsule_W.start)},
      radius{capsule_W.radius},
      inverse_squared{1.0 / std::max(along.head<2>().squaredNorm(), 1e-8)},
      tan_softness{light.tan_softness} {}

double CapsuleShadow::visibility(const Vector3& p) const {
  const Vector3 a = start - p;
  const double s = std::clamp(-a.head<2>().dot(along.head<2>()) * inverse_squared, 0.0, 1.0);
  const double height = a.z() + s * along.z();
  if (height <= 0.0) return 1.0;
  const double penumbra = 0.0008 + tan_softness * height;
  return smoothstep(-penumbra, penumbra, (a + s * along).head<2>().norm() - radius);
}

ShadowMesh::ShadowMesh(const Projector& projector)
    : arm_tiles_{projector.model().width, projector.model().height}, disc_tiles_{arm_tiles_}, capsule_tiles_{arm_tiles_} {}

void ShadowMesh::clear() {
  disc_vertices_.clear();
  arm_vertices_.clear();
  capsules_.clear();
  arm_tiles_.clear();
  disc_tiles_.clear();
}

void ShadowMesh::add_disc(const DiscState& disc, const Light& light, const Projector& projector) {
  const Vector2 shift = -light.direction_W.head<2>() / light.direction_W.z() * disc.height;  // of the top's shadow against its foot
  const double penumbra = light.tan_softness * disc.height / light.direction_W.z() / light.direction_W.z();
  const double reach = disc.radius + std::max(kOcclusionReach * disc.height, penumbra);
  TablePatch patch;
  patch.x_axis = shift.norm() > 1e-9 ? Vector2{shift.normalized()} : Vector2{Vector2::UnitX()};
  patch.origin = disc.p_WD - reach * (patch.x_axis + perpendicular(patch.x_axis));
  patch.size = {shift.norm() + 2.0 * reach, 2.0 * reach};
  patch.cells = projector.distorted() ? kCellsDistorted : 1;
  patch.mark(projector, disc_tiles_);

  const std::array<float, 4> parameters{static_cast<float>(disc.p_WD.x()), static_cast<float>(disc.p_WD.y()),
                                        static_cast<float>(disc.radius), static_cast<float>(disc.height)};
  patch.append_to(disc_vertices_, [&](const Vector2& p) { return DiscShadowVertex{clip_of(p, projector), to_float(p), parameters}; });
}

void ShadowMesh::add_capsule(const Capsule& capsule_W, const Light& light, const Projector& projector) {
  // The shadow of each piece lies in that of a ball around it.
  capsule_tiles_.clear();
  const double length = (capsule_W.end - capsule_W.start).norm();
  const int pieces = 1 + static_cast<int>(length / 0.05);
  for (int i = 0; i <= pieces; ++i) {
    const Vector3 centre = capsule_W.start + (capsule_W.end - capsule_W.start) * i / pieces;
    const double height = std::max(centre.z(), 0.0), rise = light.direction_W.z();
    const Vector2 shadow = centre.head<2>() - light.direction_W.head<2>() / rise * height;
    const double reach = (capsule_W.radius + 0.5 * length / pieces + light.tan_softness * height / rise) / rise;
    TablePatch{shadow - Vector2::Constant(reach), Vector2::UnitX(), Vector2::Constant(2.0 * reach)}.mark(projector, capsule_tiles_);
  }
  if (capsule_tiles_.empty()) return;
  arm_tiles_.mark(capsule_tiles_);
  capsules_.emplace_back(capsule_W, light);

  const CapsuleShadow& capsule = capsules_.back();
  const std::array<float, 4> start = to_float(capsule.start, capsule.radius), along = to_float(capsule.along, capsule.inverse_squared);
  const auto vertex = [&](int column, int row) {
    const Vector2 p = projector.table_point({column - 0.5, row - 0.5});
    const Vector3 p_light = light.axes_W.transpose() * Vector3{p.x(), p.y(), 0.0};
    return ArmShadowVertex{clip_of(p, projector), to_float(p), to_float(p_light), start, along};
  };
  capsule_tiles_.for_each_run([&](const PixelRect& run) {
    const int right = run.x + run.width, bottom = run.y + run.height;
    append_quad(arm_vertices_, vertex(run.x, run.y), vertex(right, run.y), vertex(right, bottom), vertex(run.x, bottom));
  });
}

void ShadowMesh::select_around(const Vector3& p_W, double radius, const Light& light) {
  selected_.clear();
  const Vector3 p = light.axes_W.transpose() * p_W;
  for (std::size_t i = 0; i < capsules_.size(); ++i) {
    CapsuleShadow grown = capsules_[i];
    grown.radius += radius;
    // Points of the ball nearer to the table lie under a wider penumbra than its centre.
    if (grown.visibility(p - Vector3{0.0, 0.0, radius}) < 1.0) selected_.push_back(i);
  }
}

double ShadowMesh::visibility(const Vector3& p_W, const Light& light) const {
  const Vector3 p = light.axes_W.transpose() * p_W;
  double visible = 1.0;
  for (const std::size_t i : selected_) visible = std::min(visible, capsules_[i].visibility(p));
  return visible;
}

}  // namespace breakshot::sim_bridge
