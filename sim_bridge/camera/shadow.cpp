#include "sim_bridge/camera/shadow.hpp"

#include "sim_bridge/camera/table_patch.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace breakshot::sim_bridge {
namespace {

/// A disc darkens the table this many heights around its foot; the shader fades to nothing there.
constexpr double kOcclusionReach = 1.25;

double smoothstep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

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

CapsuleShadow::CapsuleShadow(const Capsule& capsule_W, const Lamp& lamp)
    : start{lamp.axes_W.transpose() * capsule_W.start},
      along{lamp.axes_W.transpose() * (capsule_W.end - capsule_W.start)},
      radius{capsule_W.radius},
      inverse_squared{1.0 / std::max(along.head<2>().squaredNorm(), 1e-8)},
      tan_softness{lamp.tan_softness} {}

double CapsuleShadow::visibility(const Vector3& p) const {
  const Vector3 a = start - p;
  const double s = std::clamp(-a.head<2>().dot(along.head<2>()) * inverse_squared, 0.0, 1.0);
  const double height = a.z() + s * along.z();
  if (height <= 0.0) return 1.0;
  const double penumbra = 0.0008 + tan_softness * height;
  return smoothstep(-penumbra, penumbra, (a + s * along).head<2>().norm() - radius);
}

ShadowMesh::ShadowMesh(const Projector& projector, std::size_t lamps)
    : behind_(lamps), arm_tiles_{projector.model().width, projector.model().height}, disc_tiles_{arm_tiles_}, capsule_tiles_{arm_tiles_} {}

void ShadowMesh::clear() {
  disc_vertices_.clear();
  for (ArmShadow& behind : behind_) {
    behind.vertices.clear();
    behind.capsules.clear();
  }
  arm_tiles_.clear();
  disc_tiles_.clear();
}

bool ShadowMesh::has_arm() const {
  return std::any_of(behind_.begin(), behind_.end(), [](const ArmShadow& behind) { return !behind.vertices.empty(); });
}

void ShadowMesh::add_disc(const DiscState& disc, const Light& light, const Projector& projector) {
  // Along the first lamp's shadow: the rectangle that holds the foot and the shadow of the top before every lamp.
  const auto shift_of = [&](const Lamp& lamp) {  // of the top's shadow against its foot
    return Vector2{-lamp.direction_W.head<2>() / lamp.direction_W.z() * disc.height};
  };
  const Vector2 first = shift_of(light.lamps.front());
  const Vector2 x_axis = first.norm() > 1e-9 ? Vector2{first.normalized()} : Vector2{Vector2::UnitX()};
  double penumbra = 0.0;
  Vector2 low = Vector2::Zero(), high = Vector2::Zero();
  for (const Lamp& lamp : light.lamps) {
    penumbra = std::max(penumbra, lamp.tan_softness * disc.height / lamp.direction_W.z() / lamp.direction_W.z());
    const Vector2 shift = shift_of(lamp);
    const Vector2 along{shift.dot(x_axis), shift.dot(perpendicular(x_axis))};
    low = low.cwiseMin(along);
    high = high.cwiseMax(along);
  }
  const double reach = disc.radius + std::max(kOcclusionReach * disc.height, penumbra);
  TablePatch patch;
  patch.x_axis = x_axis;
  patch.origin = disc.p_WD + (low.x() - reach) * x_axis + (low.y() - reach) * perpendicular(x_axis);
  patch.size = high - low + Vector2::Constant(2.0 * reach);
  patch.cells = cells_for(projector, patch.size);
  patch.mark(projector, disc_tiles_);

  const std::array<float, 4> parameters{static_cast<float>(disc.p_WD.x()), static_cast<float>(disc.p_WD.y()),
                                        static_cast<float>(disc.radius), static_cast<float>(disc.height)};
  patch.append_to(disc_vertices_, [&](const Vector2& p) { return DiscShadowVertex{clip_of(p, projector), to_float(p), parameters}; });
}

void ShadowMesh::add_capsule(const Capsule& capsule_W, const Light& light, const Projector& projector) {
  for (std::size_t i = 0; i < light.lamps.size(); ++i) add_capsule(capsule_W, light.lamps[i], projector, behind_[i]);
}

void ShadowMesh::add_capsule(const Capsule& capsule_W, const Lamp& lamp, const Projector& projector, ArmShadow& behind) {
  // The shadow of each piece lies in that of a ball around it.
  capsule_tiles_.clear();
  const double length = (capsule_W.end - capsule_W.start).norm();
  const int pieces = 1 + static_cast<int>(length / 0.05);
  for (int i = 0; i <= pieces; ++i) {
    const Vector3 centre = capsule_W.start + (capsule_W.end - capsule_W.start) * i / pieces;
    const double height = std::max(centre.z(), 0.0), rise = lamp.direction_W.z();
    const Vector2 shadow = centre.head<2>() - lamp.direction_W.head<2>() / rise * height;
    const double reach = (capsule_W.radius + 0.5 * length / pieces + lamp.tan_softness * height / rise) / rise;
    TablePatch{shadow - Vector2::Constant(reach), Vector2::UnitX(), Vector2::Constant(2.0 * reach)}.mark(projector, capsule_tiles_);
  }
  if (capsule_tiles_.empty()) return;
  arm_tiles_.mark(capsule_tiles_);
  behind.capsules.emplace_back(capsule_W, lamp);

  const CapsuleShadow& capsule = behind.capsules.back();
  const std::array<float, 4> start = to_float(capsule.start, capsule.radius), along = to_float(capsule.along, capsule.inverse_squared);
  const auto vertex = [&](int column, int row) {
    const Vector2 p = projector.table_point({column - 0.5, row - 0.5});
    const Vector3 p_light = lamp.axes_W.transpose() * Vector3{p.x(), p.y(), 0.0};
    return ArmShadowVertex{clip_of(p, projector), to_float(p), to_float(p_light), start, along};
  };
  capsule_tiles_.for_each_run([&](const PixelRect& run) {
    const int right = run.x + run.width, bottom = run.y + run.height;
    append_quad(behind.vertices, vertex(run.x, run.y), vertex(right, run.y), vertex(right, bottom), vertex(run.x, bottom));
  });
}

void ShadowMesh::select_around(const Vector3& p_W, double radius, const Light& light) {
  for (std::size_t lamp = 0; lamp < behind_.size(); ++lamp) {
    ArmShadow& behind = behind_[lamp];
    behind.selected.clear();
    const Vector3 p = light.lamps[lamp].axes_W.transpose() * p_W;
    for (std::size_t i = 0; i < behind.capsules.size(); ++i) {
      CapsuleShadow grown = behind.capsules[i];
      grown.radius += radius;
      // Points of the ball nearer to the table lie under a wider penumbra than its centre.
      if (grown.visibility(p - Vector3{0.0, 0.0, radius}) < 1.0) behind.selected.push_back(i);
    }
  }
}

bool ShadowMesh::any_selected() const {
  return std::any_of(behind_.begin(), behind_.end(), [](const ArmShadow& behind) { return !behind.selected.empty(); });
}

Visibility ShadowMesh::visibility(const Vector3& p_W, const Light& light) const {
  Visibility visible;
  visible.fill(1.0F);
  for (std::size_t lamp = 0; lamp < behind_.size(); ++lamp) {
    const Vector3 p = light.lamps[lamp].axes_W.transpose() * p_W;
    for (const std::size_t i : behind_[lamp].selected) {
      visible[lamp] = std::min(visible[lamp], static_cast<float>(behind_[lamp].capsules[i].visibility(p)));
    }
  }
  return visible;
}

}  // namespace breakshot::sim_bridge
