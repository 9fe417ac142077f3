#pragma once

#include "planner/world/disc.hpp"

#include <span>
#include <vector>

namespace breakshot::bench {

/// The physics of the virtual world as ODE steps through it in time: the yardstick of `bench world`. Spheres in the plane, which is what ODE does
/// best (physics.md 1), without friction between them; Coulomb friction of the table is put in by hand, since ODE's own is not isotropic.
class OdeTable {
 public:
  OdeTable(double friction, double restitution);
  ~OdeTable();
  OdeTable(const OdeTable&) = delete;
  OdeTable& operator=(const OdeTable&) = delete;

  /// Steps until all rest. @param step  s
  std::vector<Vector2> run(std::span<const world::Disc> discs, double step);

 private:
  struct Ode;
  Ode* ode_;
  double friction_, restitution_;
};

/// The same in Box2D (single precision), with its own broad phase and its sleep switched off.
class Box2dTable {
 public:
  Box2dTable(double friction, double restitution) : friction_{friction}, restitution_{restitution} {}
  std::vector<Vector2> run(std::span<const world::Disc> discs, double step) const;

 private:
  double friction_, restitution_;
};

}  // namespace breakshot::bench
