#pragma once

#include "common/geometry.hpp"
#include "common/joints.hpp"
#include "controller/kinematics/arm_kinematics.hpp"

#include <cstddef>

namespace breakshot::kinematics {

/// Bounds and tolerances of the general solver.
struct GeneralIkOptions {
  int seeds = 200;         ///< starts: the given one, then Halton points over the joints' ranges
  int iterations = 60;     ///< per start
  double position = 1e-7;  ///< m
  double rotation = 1e-7;  ///< rad
};

/// Outcome of one search.
struct GeneralIkResult {
  bool solved = false;
  JointVector q;   ///< within limits; the nearest miss when not solved
  int starts = 0;  ///< starts used
};

/// Inverse kinematics by damped least squares for any arm of up to kMaxJoints joints, within its limits.
///
/// Each start runs Levenberg-Marquardt with the damping tied to the residual (Sugihara, "Solvability-unconcerned inverse kinematics by
/// the Levenberg-Marquardt method", IEEE T-RO 27(5), 2011). A joint that meets its limit while the step pushes outward is held there
/// and the step is solved again for the others; plain clamping, as KDL's NR_JL does it, is what makes that one stall. A start that stops
/// improving is given up for the next one.
///
/// Cost: no allocation; at most seeds * iterations steps of about 2 us.
class GeneralIk {
 public:
  explicit GeneralIk(const ArmKinematics& arm, const GeneralIkOptions& options = {}) : arm_{&arm}, options_{options} {}

  /// One solution for a tip pose in W, first from `near` and then from the Halton starts from number `first_start` on.
  GeneralIkResult solve(const Pose& X_WT, const JointVector& near, int first_start = 0) const noexcept;

 private:
  bool descend(const Pose& X_WT, JointVector& q, double& residual) const noexcept;
  JointVector start(int number, const JointVector& near) const noexcept;

  const ArmKinematics* arm_;
  GeneralIkOptions options_;
};

}  // namespace breakshot::kinematics
