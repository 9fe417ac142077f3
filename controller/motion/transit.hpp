#pragma once

#include "common/joints.hpp"
#include "controller/motion/dip.hpp"

#include <memory>

namespace breakshot::motion {

/// A move of all joints from one state to another in the shortest time that speed, acceleration and jerk allow, rounded up to whole ticks.
///
/// Both ends may be in motion. Ruckig does the work; it does not know the joints' ranges or what lies in the way, so whoever uses a
/// transit checks that.
class Transit {
 public:
  /// @param tick  s
  Transit(const JointLimits& limits, double tick);
  ~Transit();

  /// Returns whether there is one. May allocate.
  bool plan(const MotionState& from, const MotionState& to);

  /// s, a whole number of ticks.
  double duration() const;
  /// State at time t of the last planned transit.
  void at(double t, MotionState& state);

 private:
  struct Solver;  // keeps ruckig's headers out of ours
  std::unique_ptr<Solver> solver_;
};

}  // namespace breakshot::motion
