#pragma once

#include "common/joints.hpp"

#include <vector>

namespace breakshot::bench {

/// A path of the joints over its length s, sampled evenly.
struct JointPath {
  double step = 0.0;           ///< m between samples
  std::vector<JointVector> q;  ///< rad; the bound does not need them, but whoever checks it with other means does
  /// First and second derivative by s at the samples, rad/m and rad/m^2.
  std::vector<JointVector> dq, ddq;
};

/// Shortest time from rest to rest along the path with every joint within its speed and acceleration and the path speed at most `speed`, s: the
/// two passes of TOPP-RA (Pham and Pham, "A new approach to time-optimal path parameterization based on reachability analysis", IEEE T-RO
/// 34(3), 2018). No bound on jerk, so what keeps one takes longer. 0 when there is none.
double least_path_time(const JointPath& path, const JointVector& max_speed, double max_acceleration, double speed);

}  // namespace breakshot::bench
