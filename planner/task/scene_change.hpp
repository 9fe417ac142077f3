#pragma once

#include "common/scene.hpp"

namespace breakshot::task {

/// What differs between two scenes of the same discs.
struct SceneChange {
  bool same_discs = false;  ///< the same identities in both, none twice; the rest is 0 without
  bool same_order = false;  ///< and the same indices
  double furthest = 0.0;    ///< how far apart the two places of a disc are at most, m
  double in_sigmas = 0.0;   ///< the same in standard deviations of the difference, the worst disc's
  bool same_pairs = false;  ///< the same pairs have a gap below G
};

/// Beyond so many standard deviations of a difference along two axes two places are not of a disc that rests: 1 in 10,000 is.
inline constexpr double kSamePlace = 4.29;

/// How many standard deviations a difference of two places is long (Mahalanobis).
double in_sigmas(const Vector2& difference, const Matrix2& covariance) noexcept;

/// @param min_gap  G, m
/// @param floor    standard deviation of a place along each axis that neither scene's covariance tells of, m
SceneChange change_between(const Scene& before, const Scene& after, double min_gap, double floor);

}  // namespace breakshot::task
