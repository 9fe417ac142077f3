#pragma once

#include "common/geometry.hpp"
#include "common/urdf/arm_description.hpp"
#include "sim_bridge/camera/light.hpp"
#include "sim_bridge/camera/projector.hpp"
#include "sim_bridge/camera/tile_grid.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace breakshot::sim_bridge {

/// What casts the shadow of a solid of the arm: a capsule inside it. A shadow that soft does not show the difference.
struct Capsule {
  Vector3 start{0.0, 0.0, 0.0}, end{0.0, 0.0, 0.0};
  double radius = 0.0;
};
Capsule make_capsule(const Shape& shape);

/// The shadow of a capsule before one lamp: the capsule in the lamp's axes, where rays are vertical.
struct CapsuleShadow {
  CapsuleShadow(const Capsule& capsule_W, const Lamp& lamp);

  /// Share of the lamp's light that arrives at a point, given in the lamp's axes, 0 to 1.
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

/// Share of each lamp's light that arrives somewhere, 0 to 1; 1 for lamps that there are not.
using Visibility = std::array<float, kMaxLamps>;

/// The patches of table that discs and arm may shade, as triangles.
class ShadowMesh {
 public:
  ShadowMesh(const Projector& projector, std::size_t lamps);
  void clear();

  /// Adds the shadows of a disc and the darkening around its foot.
  void add_disc(const DiscState& disc, const Light& light, const Projector& projector);
  /// Adds the shadows of a solid of the arm.
  void add_capsule(const Capsule& capsule_W, const Light& light, const Projector& projector);

  /// Collects the capsules that may shade a ball; then visibility() answers for points in it.
  void select_around(const Vector3& p_W, double radius, const Light& light);
  /// What the selected capsules leave of the lamps at a point of W.
  Visibility visibility(const Vector3& p_W, const Light& light) const;
  bool any_selected() const;

  /// Where the shadows may fall.
  const TileGrid& arm_tiles() const { return arm_tiles_; }
  const TileGrid& disc_tiles() const { return disc_tiles_; }
  const std::vector<DiscShadowVertex>& disc_vertices() const { return disc_vertices_; }
  std::size_t lamps() const { return behind_.size(); }
  /// The shadows of the arm before one lamp.
  const std::vector<ArmShadowVertex>& arm_vertices(std::size_t lamp) const { return behind_[lamp].vertices; }
  bool has_arm() const;

 private:
  /// The arm's shadows before one lamp.
  struct ArmShadow {
    std::vector<ArmShadowVertex> vertices;
    std::vector<CapsuleShadow> capsules;
    std::vector<std::size_t> selected;
  };

  void add_capsule(const Capsule& capsule_W, const Lamp& lamp, const Projector& projector, ArmShadow& behind);

  std::vector<DiscShadowVertex> disc_vertices_;
  std::vector<ArmShadow> behind_;  ///< one per lamp
  TileGrid arm_tiles_, disc_tiles_;
  TileGrid capsule_tiles_;  ///< of the capsule being added
};

}  // namespace breakshot::sim_bridge
