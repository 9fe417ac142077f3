#pragma once

#include "common/result.hpp"
#include "common/stroke.hpp"
#include "common/urdf/arm_description.hpp"
#include "controller/kinematics/arm_kinematics.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "controller/motion/arm_clearance.hpp"
#include "controller/motion/motion_settings.hpp"
#include "controller/motion/stroke_search.hpp"
#include "controller/motion/trajectory.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::motion {

/// Why a stroke is not planned.
struct Refusal {
  RefusalReason reason = RefusalReason::kBadRequest;
  /// With kTooFast: a speed at which the same stroke is accepted, and at 0.99 times it too, m/s. Else 0.
  double attainable = 0.0;
  std::string text;  ///< for people: what was found and what is allowed; at most 255 characters
};

/// A planned stroke in figures.
struct StrokeTimes {
  Duration contact{};  ///< from the start (the first motion, or the set-point that the stroke goes on from) to p_WS; zero for a park
  Duration total{};    ///< from the start to rest
  /// The corridor that other discs should leave free: seen from above, along the line through p_WS, the striker is below the disc tops from
  /// low_before metres before p_WS to low_after metres past it (a push: past the end of its line).
  double low_before = 0.0;
  double low_after = 0.0;
  Duration low_time{};  ///< how long the striker is below the disc tops after p_WS (a push: after the end of its line)
  /// Least TipTracker::singularity_margin from where the striker leaves the safe height to where it is there again, m/rad; a park, and estimate(): 0.
  double singularity_margin = 0.0;
};

/// Turns stroke requests into checked trajectories.
///
/// A stroke is a transit in joint space over the discs, a Dip (down, straight along the line, up) and a transit to the park pose, joined in
/// motion. Of the arm's branches and a few shapes of the dip the quickest way is taken (StrokeSearch). The finished trajectory is measured
/// at every tick against every limit before it is handed out.
///
/// Deterministic: the same request from the same joints gives the same trajectory. Not for the real-time thread; one thread at a time.
class StrokePlanner {
 public:
  /// @throws std::invalid_argument for settings that contradict each other or the arm, e.g. a park pose outside of the joints' ranges
  StrokePlanner(const ArmDescription& arm, const Pose& X_WB, const MotionSettings& settings);

  StrokePlanner(const StrokePlanner&) = delete;
  StrokePlanner& operator=(const StrokePlanner&) = delete;

  /// Plans the whole stroke from rest at q_start. `out` is of use only when it succeeds.
  Result<StrokeTimes, Refusal> plan(const StrokeRequest& asked, const JointVector& q_start, Trajectory& out) {
    return plan(asked, MotionState::at_rest(q_start), out);
  }
  /// The same from a state in motion, which is the trajectory's first point: a stroke that another one goes on into. The striker must be at the
  /// safe height. A refusal as kJointLimit tells of this start alone: from rest the same stroke may be accepted, or refused as kTooFast.
  Result<StrokeTimes, Refusal> plan(const StrokeRequest& asked, const MotionState& start, Trajectory& out);

  /// plan() without the trajectory and its check at every tick: times are within a few ticks, and a stroke at the very edge of the limits
  /// may still be refused by plan(). Refusals say no attainable speed.
  Result<StrokeTimes, Refusal> estimate(const StrokeRequest& asked, const JointVector& q_start);

  /// Largest tip speed along a direction at a place by joint speeds and accelerations at that place alone, over all branches, m/s; 0 where
  /// the arm does not reach. An upper bound of what plan() accepts.
  double speed_bound(const Vector2& p_WS, const Vector2& direction_W) const noexcept { return search_.speed_bound(p_WS, direction_W); }

  const kinematics::ArmKinematics& kinematics() const noexcept { return kinematics_; }
  const MotionSettings& settings() const noexcept { return settings_; }
  const ArmClearance& clearance() const noexcept { return clearance_; }

 private:
  std::optional<Refusal> validate(const StrokeRequest& request, const MotionState& start) const;
  std::optional<StrokeTimes> try_plan(const StrokeRequest& request, const MotionState& start, bool first_found, Trajectory& out);
  StrokeTimes times_of(const StrokeRequest& request, const StrokeWay& way) const;
  bool assemble(const StrokeRequest& request, const StrokeWay& way, const MotionState& start, Trajectory& out);
  bool append_transit(const MotionState& from, const MotionState& to, StrokePhase phase, Trajectory& out);
  bool append(const MotionState& state, StrokePhase phase, Trajectory& out) const;
  bool keeps_limits(const Trajectory& trajectory) const;
  Refusal refuse(const StrokeRequest& request, const MotionState& start, SearchStage stage, Trajectory& out);

  MotionSettings settings_;
  kinematics::ArmKinematics kinematics_;
  kinematics::InverseKinematics ik_;
  ArmClearance clearance_;
  StrokeSearch search_;
  std::vector<MotionState> states_;        ///< scratch
  std::size_t low_from_ = 0, low_to_ = 0;  ///< ticks of the trajectory in which the tip may be low
  double singularity_margin_ = 0.0;        ///< of the last assemble()
  bool too_long_ = false;                  ///< the last assemble() ran out of ticks
};

}  // namespace breakshot::motion
