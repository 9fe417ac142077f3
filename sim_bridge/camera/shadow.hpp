#pragma once

#include "common/geometry.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/tile_grid.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <array>
#include <vector>

namespace breakshot::sim_bridge {

/// The area light, with the axes in which its rays are vertical.
struct Light {
  /// @throws CameraError when a setting is out of its range
  explicit Light(const LightSettings& settings);

  Vector3 direction_W;  ///< unit vector towards the light
  Matrix3 axes_W;       ///< columns: two unit vectors across, and direction_W
  double tan_softness;  ///< tangent of the angular radius
  double ambient;
  bool shadows;
};

/// What casts the shadow of a solid of the arm: a capsule inside it. A shadow that soft does not show the difference.
struct Capsule {
  Vector3 start{0.0, 0.0, 0.0}, end{0.0, 0.0, 0.0};
  double radius = 0.0;
};
Capsule make_capsule(const Shape& shape);

/// The shadow of a capsule: the capsule in the light's axes, where rays are vertical.
struct CapsuleShadow {
  CapsuleShadow(const Capsule& capsule_W, const Light& light);

  /// Share of the light that arrives at a point, given in the light's axes, 0 to 1.
  double visibility(const Vector3& p) const;

  Vector3 start, along;
  double radius;
  double inverse_squared;  ///< of the length across the light
  double tan_softness;
};

/// What the vertex shaders of shadows take; see shaders.hpp.
struct DiscShadowVertex {
  std::array<float, 4> clip;
  std::array<float, 2> p_W;
  std::array<float, 4> disc;
};
struct ArmShadowVertex {
  std::array<float, 4> clip;
  std::array<float, 2> p_W;
  std::array<float, 3> p_light;
  std::array<float, 4> start, along;
};

/// The patches of table that discs and arm may shade, as triangles.
class ShadowMesh {
 public:
  explicit ShadowMesh(const Projector& projector);
  void clear();

  /// Adds the shadow of a disc and the darkening around its foot.
  void add_disc(const DiscState& disc, const Light& light, const Projector& projector);
  /// Adds the shadow of a solid of the arm.
  void add_capsule(const Capsule& capsule_W, const Light& light, const Projector& projector);

  /// Collects the capsules that may shade a ball; then visibility() answers for points in it.
  void select_around(const Vector3& p_W, double radius, const Light& light);
  /// Share of the light that the selected capsules leave at a point of W, 0 to 1.
  double visibility(const Vector3& p_W, const Light& light) const;
  bool any_selected() const { return !selected_.empty(); }

  /// Where the shadows may fall.
  const TileGrid& arm_tiles() const { return arm_tiles_; }
  const TileGrid& disc_tiles() const { return disc_tiles_; }
  const std::vector<DiscShadowVertex>& disc_vertices() const { return disc_vertices_; }
  const std::vector<ArmShadowVertex>& arm_vertices() const { return arm_vertices_; }

 private:
  std::vector<DiscShadowVertex> disc_vertices_;
  std::vector<ArmShadowVertex> arm_vertices_;
  std::vector<CapsuleShadow> capsules_;
  std::vector<std::size_t> selected_;
  TileGrid arm_tiles_, disc_tiles_;
  TileGrid capsule_tiles_;  ///< of the capsule being added
};

}  // namespace breakshot::sim_bridge
