#pragma once

#include "common/geometry.hpp"
#include "common/joints.hpp"
#include "common/time.hpp"
#include "controller/motion/path_stop.hpp"

namespace breakshot::motion {

/// What every planned motion keeps. Joint ranges and speeds come from the arm's description.
struct MotionSettings {
  double max_acceleration = 10.0;  ///< of every joint, rad/s^2 (design.md section 1: our choice)
  double max_jerk = 200.0;         ///< of every joint, rad/s^3 (design.md section 1: our choice)
  double max_hit_speed = 2.0;      ///< tip speed that a hit may ask for, m/s
  double max_push_speed = 0.5;     ///< tip speed that a push may ask for, m/s
  double max_run_in = 0.30;        ///< m
  double max_length = 0.80;        ///< of a push, m
  StopLimits stop;

  /// The striker's axis stays in here while the tip is low: the table (1.4 m x 1.2 m) less 50 mm, W, m.
  Rect striker_area{{-0.65, -0.55}, {0.65, 0.55}};
  double striker_radius = 0.010;  ///< m
  double tip_height = 0.008;      ///< of the tip above the table while it strokes, m
  double disc_height = 0.020;     ///< m
  double clearance = 0.010;       ///< of the tip over the disc tops outside a stroke, m
  double link_clearance = 0.010;  ///< of every link above the table, m
  /// How far the tip may be above tip_height while it runs in: it still meets the disc's side wall, m.
  double run_in_band = 0.004;
  /// Way before a hit's run-in on which the striker may be below the disc tops while it comes down; more is avoided, not excluded, m.
  double descent = 0.050;

  JointVector park;  ///< rad; as many entries as the arm has joints
  Duration tick = std::chrono::milliseconds{1};

  /// Height of the tip at and above which it passes over discs, m.
  double safe_height() const noexcept { return disc_height + clearance; }
};

}  // namespace breakshot::motion
