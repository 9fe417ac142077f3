#pragma once

#include "common/geometry.hpp"

namespace breakshot::world {

/// A flat disc on the table, as the virtual world knows it.
struct Disc {
  Vector2 p_WD{0.0, 0.0};    ///< centre, m
  Vector2 v_WD_W{0.0, 0.0};  ///< velocity of the centre, m/s
  double radius = 0.030;     ///< m, > 0
  double mass = 0.1;         ///< kg, > 0
};

/// Gap between two discs, m; negative when they overlap.
inline double gap(const Disc& a, const Disc& b) noexcept { return (a.p_WD - b.p_WD).norm() - a.radius - b.radius; }

/// What the striker does in the plane: a straight line at constant speed, then braking until it rests or has been lifted clear of the discs.
///
/// A hit is a short cruise that ends where the striker meets the disc, so that braking begins with the contact, and the follow-through
/// is speed^2 / (2 braking) at most. A push is a long cruise.
struct StrikerRun {
  Vector2 p_WS{0.0, 0.0};       ///< axis at the start of the cruise, m
  Vector2 direction{1.0, 0.0};  ///< unit vector of travel, in W
  double speed = 0.0;           ///< during the cruise, m/s, > 0
  double cruise = 0.0;          ///< length of the cruise, m, >= 0
  double braking = 20.0;        ///< deceleration after the cruise, m/s^2, > 0
  double lift = 1e300;          ///< time from the end of the cruise until the striker is above the discs, s, > 0; it rises while it brakes
  double radius = 0.010;        ///< m, > 0
  /// How the arm behind it gives way: the change of its velocity per impulse that it takes, symmetric, 1/kg. Along a unit vector n it has the effective mass
  /// 1 / (n . mobility n) (the M of errata.md, row (19), (20)). Zero: it does not give at all.
  Matrix2 mobility{Matrix2::Zero()};
  /// Of the drives that bring it back to its run after an impact, rad/s; 0: they do so at once.
  double bandwidth = 0.0;
};

}  // namespace breakshot::world
