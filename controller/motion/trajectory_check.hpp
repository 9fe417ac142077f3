#pragma once

#include "controller/motion/arm_clearance.hpp"
#include "controller/motion/dip.hpp"
#include "controller/motion/trajectory.hpp"

#include <string>

namespace breakshot::motion {

/// What a whole trajectory makes of the limits, tick by tick. Ratios are to the limit: above 1 it is broken.
struct TrajectoryUse {
  double speed = 0.0, acceleration = 0.0, jerk = 0.0;
  double out_of_range = 0.0;        ///< furthest that a joint is outside of its range, rad
  double lowest_tip = 0.0;          ///< m above the table
  double lowest_tip_outside = 0.0;  ///< the same over the ticks before `low_from` and after `low_to`
  double lowest_link = 0.0;         ///< m above the table
  double inconsistency = 0.0;       ///< largest disagreement between speed and the change of position, rad/s
};

/// Measures a trajectory without knowing how it was made. The tip may be low from tick low_from to low_to. No allocation; about 1 us a tick.
TrajectoryUse measure(const Trajectory& trajectory, std::size_t low_from, std::size_t low_to, const JointLimits& limits,
                      const ArmClearance& clearance) noexcept;

}  // namespace breakshot::motion
