#include "sim_bridge/camera/shadow.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace breakshot::sim_bridge {
namespace {

/// A disc darkens the table this many heights around its foot; the shader fades to nothing there.
constexpr double kOcclusionReach = 2.0;
/// Cells per side of a disc's patch: how well it follows a distorting lens.
constexpr int kPatchCells = 3;

/// A vertex of a patch at a point of the table.
ShadowVertex table_vertex(const Vector2& p_W, const std::array<float, 4>& disc, const ProjectedPoint& projected) {
  return {{projected.clip.x(), projected.clip.y(), projected.clip.z(), projected.clip.w()},
          {static_cast<float>(p_W.x()), static_cast<float>(p_W.y())},
          disc};
}

/// A quadrilateral as two triangles.
void append(std::vector<ShadowVertex>& vertices, const std::array<ShadowVertex, 4>& corners) {
  for (const std::size_t i : {0U, 1U, 2U, 0U, 2U, 3U}) vertices.push_back(corners[i]);
}

/// Marks the pixels of an upright rectangle of the table; a corner behind the camera means that it is not in view as a whole: mark all.
void mark_rect(const Rect& rect, const Projector& projector, TileGrid& tiles) {
  Vector2 low = Vector2::Constant(1e9), high = Vector2::Constant(-1e9);
  for (const Vector2& corner : {rect.min, rect.max, Vector2{rect.min.x(), rect.max.y()}, Vector2{rect.max.x(), rect.min.y()}}) {
    const ProjectedPoint projected = projector.project({corner.x(), corner.y(), 0.0});
    if (!projected.in_front) {
      tiles.mark_all();
      return;
    }
    low = low.cwiseMin(projected.pixel);
    high = high.cwiseMax(projected.pixel);
  }
  tiles.mark(low.x(), low.y(), high.x(), high.y());
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

void ShadowMesh::clear() {
  disc_vertices_.clear();
  arm_vertices_.clear();
  starts_.clear();
  alongs_.clear();
}

void ShadowMesh::add_disc(const DiscState& disc, const Light& light, const Projector& projector, TileGrid& tiles) {
  const Vector2 shift = -light.direction_W.head<2>() / light.direction_W.z() * disc.height;  // of the top's shadow against its foot
  const double penumbra = light.tan_softness * disc.height / light.direction_W.z() / light.direction_W.z();
  const double reach = disc.radius + std::max(kOcclusionReach * disc.height, penumbra);
  Rect rect{disc.p_WD.cwiseMin(disc.p_WD + shift), disc.p_WD.cwiseMax(disc.p_WD + shift)};
  rect = rect.grown(reach);
  mark_rect(rect, projector, tiles);

  const std::array<float, 4> parameters{static_cast<float>(disc.p_WD.x()), static_cast<float>(disc.p_WD.y()),
                                        static_cast<float>(disc.radius), static_cast<float>(disc.height)};
  const auto vertex = [&](int column, int row) {
    const Vector2 share{static_cast<double>(column) / kPatchCells, static_cast<double>(row) / kPatchCells};
    const Vector2 p = rect.min + share.cwiseProduct(rect.max - rect.min);
    return table_vertex(p, parameters, projector.project({p.x(), p.y(), 0.0}));
  };
  for (int row = 0; row < kPatchCells; ++row) {
    for (int column = 0; column < kPatchCells; ++column) {
      append(disc_vertices_, {vertex(column, row), vertex(column + 1, row), vertex(column + 1, row + 1), vertex(column, row + 1)});
    }
  }
}

void ShadowMesh::add_capsule(const Capsule& capsule_W, const Light& light, const Projector& projector, TileGrid& arm_tiles) {
  if (starts_.size() == kMaxCapsules) return;

  // In the light's axes a ray is vertical, so the distance to a ray is a distance in the first two coordinates.
  const Vector3 start = light.axes_W.transpose() * capsule_W.start, end = light.axes_W.transpose() * capsule_W.end;
  const Eigen::Vector3f along = (end - start).cast<float>(), from = start.cast<float>();
  const float across_squared = std::max(along.head<2>().squaredNorm(), 1e-8F);
  starts_.push_back({from.x(), from.y(), from.z(), static_cast<float>(capsule_W.radius)});
  alongs_.push_back({along.x(), along.y(), along.z(), 1.0F / across_squared});

  // The shadow of each piece lies in that of a ball around it.
  const double length = (capsule_W.end - capsule_W.start).norm();
  const int balls = 1 + static_cast<int>(length / 0.05);
  for (int i = 0; i <= balls; ++i) {
    const Vector3 centre = capsule_W.start + (capsule_W.end - capsule_W.start) * i / balls;
    const double height = std::max(centre.z(), 0.0), rise = light.direction_W.z();
    const Vector2 shadow = centre.head<2>() - light.direction_W.head<2>() / rise * height;
    const double reach = (capsule_W.radius + 0.5 * length / balls + light.tan_softness * height / rise) / rise;
    mark_rect(Rect{shadow, shadow}.grown(reach), projector, arm_tiles);
  }
}

void ShadowMesh::add_arm_patches(const TileGrid& arm_tiles, const Projector& projector) {
  arm_tiles.for_each_run([&](const PixelRect& run) {
    for (int left = run.x; left < run.x + run.width; left += TileGrid::kTile) {
      const int right = std::min(left + TileGrid::kTile, run.x + run.width);
      std::array<ShadowVertex, 4> corners{};
      const std::array<Vector2, 4> pixels{Vector2{left - 0.5, run.y - 0.5}, Vector2{right - 0.5, run.y - 0.5},
                                          Vector2{right - 0.5, run.y + run.height - 0.5}, Vector2{left - 0.5, run.y + run.height - 0.5}};
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vector2 p = projector.table_point(pixels[i]);
        corners[i] = table_vertex(p, {}, projector.project({p.x(), p.y(), 0.0}));
      }
      append(arm_vertices_, corners);
    }
  });
}

}  // namespace breakshot::sim_bridge
