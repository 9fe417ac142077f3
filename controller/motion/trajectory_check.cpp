#include "controller/motion/trajectory_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace breakshot::motion {

TrajectoryUse measure(const Trajectory& trajectory, std::size_t low_from, std::size_t low_to, const JointLimits& limits,
                      const ArmClearance& clearance) noexcept {
  TrajectoryUse use;
  use.lowest_tip = use.lowest_tip_outside = use.lowest_link = std::numeric_limits<double>::infinity();
  const double h = to_seconds(trajectory.tick);
  JointVector q(trajectory.joints);
  for (std::size_t k = 0; k < trajectory.size; ++k) {
    const TrajectoryPoint& now = trajectory.points[k];
    for (std::size_t j = 0; j < static_cast<std::size_t>(trajectory.joints); ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      q[i] = now.q[j];
      use.speed = std::max(use.speed, std::abs(now.qd[j]) / limits.speed[i]);
      use.acceleration = std::max(use.acceleration, std::abs(now.qdd[j]) / limits.acceleration);
      use.out_of_range = std::max({use.out_of_range, now.q[j] - limits.upper[i], limits.lower[i] - now.q[j]});
      if (k == 0) continue;
      const TrajectoryPoint& last = trajectory.points[k - 1];
      use.jerk = std::max(use.jerk, std::abs(now.qdd[j] - last.qdd[j]) / (h * limits.jerk));
      // The same from the speeds: the drives follow these, and an acceleration that was itself taken from speeds hides what changes within a tick.
      const double change = now.qd[j] - last.qd[j];
      use.acceleration = std::max(use.acceleration, std::abs(change) / (h * limits.acceleration));
      // What came before the first tick was at rest, or another trajectory that this one goes on from with its acceleration.
      const double change_before = k >= 2 ? last.qd[j] - trajectory.points[k - 2].qd[j] : h * last.qdd[j];
      use.jerk = std::max(use.jerk, std::abs(change - change_before) / (h * h * limits.jerk));
      // Simpson-like rule with the accelerations at both ends: exact for constant jerk.
      const double mean_speed = 0.5 * (now.qd[j] + last.qd[j]) - h / 12.0 * (now.qdd[j] - last.qdd[j]);
      use.inconsistency = std::max(use.inconsistency, std::abs((now.q[j] - last.q[j]) / h - mean_speed));
    }
    const ArmClearance::Heights heights = clearance.heights(q);
    use.lowest_tip = std::min(use.lowest_tip, heights.tip);
    if (k < low_from || k > low_to) use.lowest_tip_outside = std::min(use.lowest_tip_outside, heights.tip);
    use.lowest_link = std::min(use.lowest_link, heights.links);
  }
  return use;
}

}  // namespace breakshot::motion
