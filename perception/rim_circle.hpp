#pragma once

#include "common/geometry.hpp"

#include <Eigen/Core>

#include <optional>
#include <vector>

namespace breakshot::perception {

/// One place of a disc's outline.
struct Edge {
  Vector2 n_W{1.0, 0.0};  ///< direction from the centre
  double range = 0.0;     ///< distance of the edge from the centre that it was measured about, m
  bool foot = false;      ///< where the wall meets the table; else the top rim
  double trust = 1.0;     ///< weight by what kind of edge it is, 0 to 1
  double weight = 1.0;    ///< by how well it agrees with the circle, 0 to 1
  /// Its distance from the circle x = (x, y, radius), which lies about that centre, m.
  double error(const Vector3& x) const noexcept { return range - x.z() - n_W.dot(x.head<2>()); }
};

/// Standard deviations of what edges err by beside their own noise, m.
struct SharedErrors {
  double floor = 0.0;  ///< the least that an edge errs by itself
  double patch = 0.0;  ///< shared by the edges of an eighth of the outline
  double foot = 0.0;   ///< shared by all edges of the foot
  double arc = 0.0;    ///< as `patch`, of an outline of which next to nothing is seen
};

/// A circle about the centre that its edges were measured about.
struct RimCircle {
  Vector3 x{Vector3::Zero()};           ///< of its centre, and radius, m
  Matrix3 covariance{Matrix3::Zero()};  ///< of x, m^2
};

/// The circle of robust least squares through edges; `edges` receive their weights.
///
/// The dark line where a wall stands on the table shifts all edges of the foot alike, by more or less under other lamps: that shift is an unknown of the
/// fit beside the circle, known beforehand to be about SharedErrors::foot. So it costs certainty, not truth, wherever enough of the top rim shows.
/// @param directions  that were looked into, all around
/// @return nothing when the edges do not determine a circle
std::optional<RimCircle> fit_circle(std::vector<Edge>& edges, double radius, int directions, const SharedErrors& errors);

/// The circle that most edges agree with, for edges that something foreign may have too.
///
/// What covers a disc in part has edges. They are no circle with the disc's own, so least squares, however robust, would settle on neither
/// where they are many. Tries three edges at a time, at several spacings all around: the same for the same edges.
Vector3 circle_of_most(const std::vector<Edge>& edges, double tolerance);

}  // namespace breakshot::perception
