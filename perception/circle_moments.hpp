#pragma once

#include "common/geometry.hpp"

#include <cmath>
#include <optional>

namespace breakshot::perception {

struct Circle {
  Vector2 p_WD{0.0, 0.0};  ///< m
  double radius = 0.0;     ///< m
};

/// Sums over points from which a circle is fitted in a time that does not depend on how many there are; those of two sets add up.
///
/// Coordinates are relative to a nearby origin that the sets share, so that nothing of their precision is lost.
struct CircleMoments {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0, zz = 0;  // z = x^2 + y^2

  void add(const Vector2& p) noexcept {
    const double z = p.squaredNorm();
    n += 1;
    x += p.x();
    y += p.y();
    xx += p.x() * p.x();
    xy += p.x() * p.y();
    yy += p.y() * p.y();
    xz += p.x() * z;
    yz += p.y() * z;
    zz += z * z;
  }
  CircleMoments& operator+=(const CircleMoments& o) noexcept {
    n += o.n;
    x += o.x;
    y += o.y;
    xx += o.xx;
    xy += o.xy;
    yy += o.yy;
    xz += o.xz;
    yz += o.yz;
    zz += o.zz;
    return *this;
  }

  /// The circle of least squares in Taubin's measure (PAMI 13, 1991), which unlike the plain algebraic one does not shrink short arcs;
  /// `rms` receives about the root mean square distance of the points from it, m. Nothing for points on a line.
  std::optional<Circle> fit(double& rms) const noexcept;
};

}  // namespace breakshot::perception
