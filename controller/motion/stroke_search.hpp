#pragma once

#include "common/stroke.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "controller/motion/arm_clearance.hpp"
#include "controller/motion/dip.hpp"
#include "controller/motion/motion_settings.hpp"
#include "controller/motion/transit.hpp"

#include <optional>
#include <utility>

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
/// keeps the limits with transits; when there is none, many more shapes. Decides on samples a few milliseconds apart; the finished trajectory is checked at every tick elsewhere.
class StrokeSearch {
 public:
  /// Keeps pointers to all of them.
  StrokeSearch(const kinematics::ArmKinematics& arm, const kinematics::InverseKinematics& ik, const ArmClearance& clearance,
               const MotionSettings& settings);

  /// The quickest way, or with `first_found` just any; the request was validated.
  /// @param share  of the acceleration and jerk limits that dips may use, (0, 1]
  std::optional<StrokeWay> find(const StrokeRequest& request, const MotionState& begin, double share, bool first_found);
  /// After a find() without success.
  SearchStage stage() const noexcept { return stage_; }

  /// See StrokePlanner::speed_bound.
  double speed_bound(const Vector2& p_WS, const Vector2& direction_W) const noexcept;

  /// Ticks, counted from a dip's time 0, at which transits join it.
  int first_tick(const Dip& dip) const noexcept;
  int last_tick(const Dip& dip) const noexcept;

  Transit& transit() noexcept { return transit_; }
  const TipTracker& tracker() const noexcept { return tracker_; }
  const JointLimits& limits() const noexcept { return limits_; }

 public:
  struct Variety;  // what shapes are tried; of the implementation alone

 private:
  /// What a branch can do at p_WS.
  struct Branch {
    JointVector q;
    JointVector per_way, per_climb;  ///< joint speeds for 1 m/s along the stroke's direction, and upward
    JointVector bend;                ///< joint accelerations when the tip passes at the asked speed without acceleration of its own
  };
  /// Accelerations of the tip at a hit's contact, m/s^2.
  struct TipAcceleration {
    double climb, along;
  };
  /// One half of a dip that keeps the limits, with the transit that joins it.
  struct Side {
    Dip dip;            ///< of which only this half is set
    MotionState joint;  ///< where it meets the transit
    double time = 0.0;  ///< of the half and its transit, s
    double cost = 0.0;  ///< time, and what a long low corridor counts for, s
  };

  void try_branches(const StrokeRequest& request, const JointVector& q_start, double share, bool first_found, const StrokeWay& start,
                    const MotionState& from);
  kinematics::IkSolutions branches(const Vector2& p_WS, const JointVector& near) const noexcept;
  bool find_lift(const JointVector& q_start, double share, StrokeWay& way, MotionState& from);
  void try_hit(const StrokeRequest& request, const Branch& branch, double share, const StrokeWay& start, const MotionState& from);
  void try_push(const StrokeRequest& request, const Branch& branch, double share, const StrokeWay& start, const MotionState& from);
  /// The best half before (after) a hit's contact.
  std::optional<Side> approach(const StrokeRequest& request, const Branch& branch, const TipAcceleration& a, double share,
                               const MotionState& from);
  std::optional<Side> approach(const StrokeRequest& request, const Branch& branch, const TipAcceleration& a, double share,
                               double jerk_share, const MotionState& from);
  std::optional<Side> leave(const StrokeRequest& request, const Branch& branch, const TipAcceleration& a, double share, bool level);
  /// Least and most acceleration along the line at p_WS that the joints allow next to `climb` upward, m/s^2; least > most: none.
  std::pair<double, double> line_acceleration(const Branch& branch, double climb, double share) const noexcept;
  /// No transit between these places is shorter than this, s; with one of its ends at rest it is longer.
  double least_duration(const JointVector& a, const JointVector& b, bool one_rests) const noexcept;
  JointVector bend(const JointVector& q, const Vector3& v_WT_W) const noexcept;
  JointVector end_pose(const StrokeRequest& request, const MotionState& leaving) const;
  bool transit_is_clear();
  bool in_area(const Dip& dip, double t) const noexcept;
  void reached(SearchStage stage) noexcept { stage_ = std::max(stage_, stage); }

  std::optional<StrokeWay> best_;
  double best_cost_ = 0.0;

  const Variety* variety_ = nullptr;  ///< of the pass of find() that is under way

  const kinematics::ArmKinematics* arm_;
  const kinematics::InverseKinematics* ik_;
  const ArmClearance* clearance_;
  const MotionSettings* settings_;
  TipTracker tracker_;
  JointLimits limits_;
  Transit transit_;
  double tick_;  ///< s

  SearchStage stage_ = SearchStage::kReach;
};

}  // namespace breakshot::motion
