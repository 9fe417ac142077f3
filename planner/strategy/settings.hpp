#pragma once

#include "common/geometry.hpp"
#include "planner/world/virtual_world.hpp"

#include <string>

namespace breakshot::strategy {

/// What the planner believes of the cell before it has seen anything: prior knowledge, not the simulator's truth.
struct CellKnowledge {
  world::WorldSettings world{.touch_gap = 5e-4};  ///< a gap below what the camera resolves counts as touching, as in the paper
  std::string impact_law = "paper_corrected";
  double disc_mass = 0.1;         ///< of a disc of disc_radius; others weigh by their area, kg
  double disc_radius = 0.030;     ///< m
  double striker_radius = 0.010;  ///< m
  double striker_mass = 1.2;      ///< effective mass of the arm at the tip, kg; errata.md row (19), (20)
  /// What the striker does after a hit, in the way that motion::StrokePlanner does it: it hardly brakes but rises at once. Measured over 300
  /// hits of 0.3 to 1.1 m/s all over the workspace: above the discs 0.12 s after the contact, having gone on at 0.95 to 1.0 of the speed.
  double hit_braking = 0.5;  ///< m/s^2
  double hit_lift = 0.12;    ///< from contact until the tip has risen above the discs, s
  double hit_fall = 0.15;    ///< the tip is lower than the discs' tops from at most so long before the contact, s (measured: 0.12)
  Vector2 p_WB{-0.5, 0.0};   ///< the arm's base: "nearer to the arm" is nearer to it, m
  /// Where the striker's axis may be while it is low, W, m; the controller refuses what leaves its own (motion::MotionSettings).
  Rect striker_area{{-0.44, -0.44}, {0.44, 0.44}};
};

/// How strokes are made and chosen; the same for every strategy, so that they compare.
struct StrokeRules {
  // The paper: hits for more than four discs in one cluster.
  int hit_above = 4;
  /// Discs nearer than this are in contact: the paper's thickened contours of such discs overlap, m.
  double contact_gap = 0.003;
  /// A disc that stands apart but within this gap of a cluster can serve as its cue disc (Fig. 11), m.
  double cue_gap = 0.080;
  double contour_thickness = 0.003;  ///< by which contours are thickened, m; gives a contour length to pairs that perception lists none for

  double hit_speed_min = 0.30, hit_speed_max = 1.20, hit_speed_step = 0.05;  ///< m/s; hit_speed_max is scaled by the order's speed_scale
  double hit_run_in = 0.030;                                                 ///< straight and at full speed, m
  double push_speed = 0.15;                                                  ///< m/s: discs let go at it slide on by 5 mm at most
  double landing_margin = 0.003;                                             ///< between the striker and any disc when it comes down, m
  /// In the virtual world a disc counts as leaving when it comes to rest within this of the region's border: what predictions err by, m.
  double border_margin_hit = 0.10;
  double border_margin_push = 0.010;
  double stroke_time = 1.2;  ///< of a stroke from decision to decision, s; only for the cost that is reported
  int alternatives = 6;      ///< strokes offered per decision, best first
};

struct StrategySettings {
  CellKnowledge cell;
  StrokeRules rules;
};

}  // namespace breakshot::strategy
