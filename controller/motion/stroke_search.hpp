#pragma once

#include "common/stroke.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "controller/motion/arm_clearance.hpp"
#include "controller/motion/dip.hpp"
#include "controller/motion/motion_settings.hpp"
#include "controller/motion/transit.hpp"

#include <optional>

namespace breakshot::motion {

/// A way to do a stroke: what is between the rests at its start and end.
struct StrokeWay {
  std::optional<Dip> lift;  ///< first straight up, when the tip is low at the start: a Dip from time 0 on
  JointVector q_lift;       ///< joints at its time 0
  std::optional<Dip> dip;   ///< none for a park
  JointVector q_dip;        ///< joints at its time 0
  JointVector q_end;        ///< joints at rest at the end
  double duration = 0.0;    ///< s; within a few ticks
};

/// How far a search without success came.
enum class SearchStage { kReach, kArea, kSpeed, kLimits, kTransit };

/// Finds the quickest way to do a stroke.
///
/// Tries the arm's branches at p_WS and, for each, a few shapes of the dip, from the most to the least demanding, and joins the first that
/// keeps the limits with transits. Decides on samples a few milliseconds apart; the finished trajectory is checked at every tick elsewhere.
class StrokeSearch {
 public:
  /// Keeps pointers to all of them.
  StrokeSearch(const kinematics::ArmKinematics& arm, const kinematics::InverseKinematics& ik, const ArmClearance& clearance,
               const MotionSettings& settings);

  /// The quickest way, or with `first_found` just any; the request was validated.
  /// @param share  of the acceleration and jerk limits that dips may use, (0, 1]
  std::optional<StrokeWay> find(const StrokeRequest& request, const JointVector& q_start, double share, bool first_found);
  /// After a find() without success.
  SearchStage stage() const noexcept { return stage_; }

  /// See StrokePlanner::speed_bound.
  double speed_bound(const Vector2& p_WS, const Vector2& direction_W) const noexcept;

  /// Samples a dip at whole ticks from `first` to `last` (ticks relative to time 0); q0 are the joints at time 0. Returns whether the arm
  /// can follow. Used for the search's ends and for the trajectory itself, so both agree.
  bool sample(const Dip& dip, const JointVector& q0, int first, int last, std::vector<MotionState>& states) const;
  int first_tick(const Dip& dip) const noexcept;
  int last_tick(const Dip& dip) const noexcept;

  Transit& transit() noexcept { return transit_; }
  const JointLimits& limits() const noexcept { return limits_; }

 private:
  struct Ends {
    MotionState entry, exit;
  };

  kinematics::IkSolutions branches(const Vector2& p_WS, const JointVector& near) const noexcept;
  bool find_lift(const JointVector& q_start, double share, StrokeWay& way, MotionState& from);
  void try_hit(const StrokeRequest& request, const JointVector& q, double share, const StrokeWay& start, const MotionState& from);
  void try_push(const StrokeRequest& request, const JointVector& q, double share, const StrokeWay& start, const MotionState& from);
  bool try_transits(const StrokeRequest& request, StrokeWay way, const MotionState& from);
  bool transit_is_clear(double floor);
  bool in_area(const Dip& dip, double from, double to) const noexcept;
  void reached(SearchStage stage) noexcept { stage_ = std::max(stage_, stage); }

  const kinematics::ArmKinematics* arm_;
  const kinematics::InverseKinematics* ik_;
  const ArmClearance* clearance_;
  const MotionSettings* settings_;
  TipTracker tracker_;
  JointLimits limits_;
  Transit transit_;
  double tick_;  ///< s

  SearchStage stage_ = SearchStage::kReach;
  std::optional<StrokeWay> best_;
  std::vector<MotionState> ends_;  ///< scratch
};

}  // namespace breakshot::motion
