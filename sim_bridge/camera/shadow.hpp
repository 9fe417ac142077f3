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

/// Capsules that the shaders take; an arm has about twenty solids.
inline constexpr std::size_t kMaxCapsules = 32;

/// What the vertex shader of shadows takes; see shaders.hpp.
struct ShadowVertex {
  std::array<float, 4> clip;
  std::array<float, 2> p_W;
  std::array<float, 4> disc;
};

/// The patches of table that discs and arm may shade, as triangles, and the arm as capsules in the light's axes.
class ShadowMesh {
 public:
  void clear();
  /// Adds the shadow of a disc and the darkening around its foot.
  void add_disc(const DiscState& disc, const Light& light, const Projector& projector, TileGrid& tiles);
  /// Adds a solid of the arm. @throws nothing; beyond kMaxCapsules solids cast no shadow
  void add_capsule(const Capsule& capsule_W, const Light& light, const Projector& projector, TileGrid& arm_tiles);
  /// Adds a patch of table per marked tile, to be shaded by all capsules.
  void add_arm_patches(const TileGrid& arm_tiles, const Projector& projector);

  const std::vector<ShadowVertex>& disc_vertices() const { return disc_vertices_; }
  const std::vector<ShadowVertex>& arm_vertices() const { return arm_vertices_; }
  /// As the shaders take them: capsule_start and capsule_along.
  const std::vector<std::array<float, 4>>& capsule_starts() const { return starts_; }
  const std::vector<std::array<float, 4>>& capsule_alongs() const { return alongs_; }

 private:
  std::vector<ShadowVertex> disc_vertices_, arm_vertices_;
  std::vector<std::array<float, 4>> starts_, alongs_;
};

}  // namespace breakshot::sim_bridge
