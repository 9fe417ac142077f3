#include "planner/planner_config.hpp"

#include "planner/strategy/strategy.hpp"
#include "planner/world/impact_law.hpp"

#include <algorithm>
#include <numbers>

namespace breakshot::planner {

namespace {

constexpr double kMetrePerMillimetre = 1e-3;

double millimetres(const ConfigNode& node, const char* key, Range range) { return kMetrePerMillimetre * node.number(key, range, "mm"); }
Duration milliseconds(const ConfigNode& node, const char* key, Range range) { return from_seconds(1e-3 * node.number(key, range, "ms")); }
Duration seconds(const ConfigNode& node, const char* key, Range range) { return from_seconds(node.number(key, range, "s")); }

strategy::CellKnowledge load_knowledge(const ConfigNode& node, const CellConfig& cell) {
  strategy::CellKnowledge knowledge;
  knowledge.striker_radius = cell.striker_radius;
  knowledge.p_WB = cell.arm.X_WB.translation().head<2>();

  knowledge.impact_law = node.choice("impact_law", world::impact_law_names());
  knowledge.world.friction = node.number("friction", {0.01, 2.0}, "");
  knowledge.world.restitution = node.number("restitution", {0.0, 1.0}, "");
  knowledge.world.striker_restitution = node.number("striker_restitution", {0.0, 1.0}, "");
  knowledge.world.touch_gap = millimetres(node, "touch_gap_mm", {0.001, 5.0});
  knowledge.disc_mass = node.number("disc_mass", {0.001, 10.0}, "kg");
  knowledge.disc_radius = node.number("disc_radius", {cell.disc_radius_min, cell.disc_radius_max}, "m");
  knowledge.striker_mass = node.number("striker_mass", {0.01, 1e6}, "kg");
  knowledge.world.striker_bounce_speed = node.number("striker_bounce_speed", {0.0, 1.0}, "m/s");
  knowledge.drive_bandwidth = node.number("drive_bandwidth", {0.0, 2000.0}, "rad/s");
  knowledge.hit_braking = node.number("hit_braking", {0.01, 100.0}, "m/s^2");
  knowledge.hit_lift = node.number("hit_lift_s", {0.01, 2.0}, "s");
  knowledge.hit_fall = node.number("hit_fall_s", {0.0, 2.0}, "s");
  const ConfigNode area = node.child("striker_area");
  knowledge.striker_area = {area.vector2("min", {-2.0, 2.0}), area.vector2("max", {-2.0, 2.0})};
  if ((knowledge.striker_area.min.array() >= knowledge.striker_area.max.array()).any()) {
    area.refuse("max", "a corner that is not beyond min", "max greater than min in x and y");
  }
  return knowledge;
}

strategy::StrokeRules load_rules(const ConfigNode& node) {
  strategy::StrokeRules rules;
  rules.hit_above = static_cast<int>(node.integer("hit_above", 1, 64));
  rules.contact_gap = millimetres(node, "contact_gap_mm", {0.0, 20.0});
  rules.cue_gap = millimetres(node, "cue_gap_mm", {0.0, 500.0});
  rules.contour_thickness = millimetres(node, "contour_thickness_mm", {0.0, 20.0});
  rules.hit_speed_min = node.number("hit_speed_min", {0.05, 5.0}, "m/s");
  rules.hit_speed_max = node.number("hit_speed_max", {rules.hit_speed_min, 5.0}, "m/s");
  rules.hit_speed_step = node.number("hit_speed_step", {0.01, 1.0}, "m/s");
  rules.hit_run_in = millimetres(node, "hit_run_in_mm", {1.0, 300.0});
  rules.push_speed = node.number("push_speed", {0.01, 0.5}, "m/s");
  rules.landing_margin = millimetres(node, "landing_margin_mm", {0.0, 50.0});
  rules.border_margin_hit = millimetres(node, "border_margin_hit_mm", {0.0, 500.0});
  rules.border_margin_push = millimetres(node, "border_margin_push_mm", {0.0, 500.0});
  rules.stroke_time = node.number("stroke_time_s", {0.1, 60.0}, "s");
  rules.alternatives = static_cast<int>(node.integer("alternatives", 1, 20));
  return rules;
}

strategy::RobustRules load_robust(const ConfigNode& node) {
  constexpr double kRadianPerDegree = std::numbers::pi / 180.0;
  strategy::RobustRules robust;
  robust.friction_spread = node.number("friction_spread", {0.0, 0.9}, "");
  robust.restitution_spread = node.number("restitution_spread", {0.0, 0.5}, "");
  robust.speed_spread = node.number("speed_spread", {0.0, 0.5}, "");
  robust.aim_spread = kRadianPerDegree * node.number("aim_spread_deg", {0.0, 20.0}, "deg");
  robust.position_sigma = millimetres(node, "position_sigma_mm", {0.0, 5.0});
  robust.striker_spread = node.number("striker_spread", {0.0, 0.9}, "");
  robust.compliant_share = node.number("compliant_share", {0.0, 0.8}, "");
  robust.contact_time_min = 1e-3 * node.number("contact_time_min_ms", {0.01, 10.0}, "ms");
  robust.contact_time_max = 1e-3 * node.number("contact_time_max_ms", {1e3 * robust.contact_time_min, 10.0}, "ms");
  robust.gap_margin = millimetres(node, "gap_margin_mm", {0.0, 10.0});
  robust.worlds = static_cast<int>(node.integer("worlds", 1, 10'000));
  robust.rollouts = static_cast<int>(node.integer("rollouts", 100, 10'000'000));
  robust.hit_time = node.number("hit_time_s", {0.1, 60.0}, "s");
  robust.push_time = node.number("push_time_s", {0.1, 60.0}, "s");
  robust.settle_time = node.number("settle_time_s", {0.0, 60.0}, "s");
  robust.rest_time = node.number("rest_time_s", {0.0, 60.0}, "s");
  robust.pair_time = node.number("pair_time_s", {0.0, 60.0}, "s");
  robust.lost_price = node.number("lost_price_s", {0.0, 1e6}, "s");
  robust.edge_price = node.number("edge_price_s", {0.0, 1e3}, "s");
  robust.edge_width = millimetres(node, "edge_width_mm", {1.0, 500.0});
  return robust;
}

estimate::EstimateSettings load_estimate(const ConfigNode& node) {
  estimate::EstimateSettings settings;
  settings.friction_factor = node.number("friction_factor", {1.01, 5.0}, "");
  settings.friction_local_spread = node.number("friction_local_spread", {0.0, 0.5}, "");
  settings.restitution_sigma = node.number("restitution_sigma", {0.001, 0.5}, "");
  return settings;
}

task::TaskSettings load_task(const ConfigNode& node) {
  task::TaskSettings task;
  task.resend = milliseconds(node, "resend_ms", {20.0, 5000.0});
  task.controller_silence = seconds(node, "controller_silence_s", {0.1, 60.0});
  task.scene_silence = seconds(node, "scene_silence_s", {0.1, 60.0});
  task.settle_limit = seconds(node, "settle_limit_s", {0.5, 120.0});
  task.settle_speed = node.number("settle_speed", {1e-4, 1.0}, "m/s");
  task.settled_scenes = static_cast<int>(node.integer("settled_scenes", 1, 100));
  task.count_scenes = static_cast<int>(node.integer("count_scenes", task.settled_scenes, 1000));
  task.park_first = node.flag("park_first");
  task.plan_ahead = node.flag("plan_ahead");
  task.ahead_sigma = millimetres(node, "ahead_sigma_mm", {0.01, 10.0});
  task.seed = static_cast<std::uint64_t>(node.integer("seed", 0, 1'000'000'000));
  return task;
}

}  // namespace

PlannerConfig load_planner_config(const ConfigDocument& document, const CellConfig& cell) {
  const ConfigNode node = document.section("planner");
  PlannerConfig config;
  config.strategy = node.choice("strategy", strategy::strategy_names());
  config.ask_arm = node.flag("ask_arm");
  config.clock_silence = seconds(node, "clock_silence_s", {1.0, 600.0});
  config.settings.cell = load_knowledge(node.child("knowledge"), cell);
  config.settings.rules = load_rules(node.child("rules"));
  config.settings.robust = load_robust(node.child("robust"));
  config.learn = node.flag("learn");
  config.estimate = load_estimate(node.child("estimate"));
  config.task = load_task(node.child("task"));
  node.finish();
  return config;
}

}  // namespace breakshot::planner
