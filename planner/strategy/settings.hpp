#pragma once

#include "common/geometry.hpp"
#include "planner/world/virtual_world.hpp"

#include <string>

namespace breakshot::strategy {

/// What the planner believes of the cell before it has seen anything: prior knowledge, not the simulator's truth.
struct CellKnowledge {
  world::WorldSettings world{.striker_bounce_speed = 0.2,
                             .touch_gap = 5e-4};  ///< a gap below what the camera resolves counts as touching, as in the paper
  std::string impact_law = "paper_corrected";
  double disc_mass = 0.1;         ///< of a disc of disc_radius; others weigh by their area, kg
  double disc_radius = 0.030;     ///< m
  double striker_radius = 0.010;  ///< m
  double striker_mass = 1.15;     ///< effective mass of the arm at the tip, kg; errata.md row (19), (20)
  double drive_bandwidth = 150;   ///< of the drives, which bring the striker back to its way after an impact, rad/s
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
  double border_margin_hit = 0.11;
  double border_margin_push = 0.010;
  double stroke_time = 1.2;  ///< of a stroke from decision to decision, s; only for the cost that is reported
  int alternatives = 6;      ///< strokes offered per decision, best first
};

/// How `robust` weighs strokes: what it does not know, how long it thinks, what a failure is worth.
struct RobustRules {
  // Half widths of what is drawn evenly about the planner's knowledge; about what the protocol of singulation.md 5 asks for.
  double friction_spread = 0.15;     ///< relative
  double restitution_spread = 0.05;  ///< absolute; between discs and at the striker alike
  double speed_spread = 0.03;        ///< of a hit, relative
  double aim_spread = 0.0087;        ///< of a direction, rad: 0.5 degrees
  /// Least standard deviation of a disc's position along each axis, m: what perception's covariance does not tell.
  double position_sigma = 5e-5;
  double striker_spread = 0.2;  ///< of the striker's mass, its drives' bandwidth and the speed below which nothing bounces off it, relative
  /// Share of the worlds in which contacts last, so that discs which nearly touch are loaded at the same time: law `compliant`; in the others impacts are
  /// instants, one after the other: `sequential`. Nobody knows which of them a table obeys, and the two part ways where gaps are below speed x contact time.
  double compliant_share = 0.25;
  double contact_time_min = 1e-4, contact_time_max = 4e-4;  ///< of a contact that lasts, s: real discs (singulation.md)
  double gap_margin = 5e-4;  ///< a gap has to be so much above G, m: perception will measure it with an error
  int worlds = 96;           ///< in which the strokes of the last round are tried
  int rollouts =
      6'000;  ///< of a decision about eight discs or fewer, all told; bounds its time, and unlike a clock gives the same answer again
  double hit_time = 1.7;     ///< from decision to decision, of a hit, s; the arm's own forecast replaces the arm's part where there is one
  double push_time = 1.6;    ///< the same of a push, without the time on its line
  double settle_time = 0.7;  ///< look, think and settle, the part that the arm's forecast does not hold, s
  // What is still to come after a stroke that leaves pairs below G, fitted over decisions of `bench singulation` (docs/strategies.md): most of it does not
  // depend on how many there are, because the next stroke parts several.
  double rest_time = 1.7;    ///< s
  double pair_time = 0.1;    ///< more for each of them, s
  double lost_price = 60.0;  ///< a disc outside the region, s
  double edge_price = 0.5;   ///< a disc at the border, s; falls to nothing at edge_width from it
  double edge_width = 0.04;  ///< m
};

struct StrategySettings {
  CellKnowledge cell;
  StrokeRules rules;
  RobustRules robust;
};

}  // namespace breakshot::strategy
