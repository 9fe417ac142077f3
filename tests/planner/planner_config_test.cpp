#include "planner/planner_config.hpp"

#include "planner/strategy/strategy.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace breakshot::planner {
namespace {

const char* const kCellFile = BREAKSHOT_SOURCE_DIR "/config/cell.yaml";

PlannerConfig load(const std::vector<std::string>& overrides = {}) {
  const ConfigDocument document = load_cell_document(kCellFile, overrides);
  return load_planner_config(document, load_cell_config(document));
}

TEST(PlannerConfig, TheShippedOneSaysWhatTheCodeDefaultsTo) {
  const PlannerConfig config = load();
  const strategy::StrategySettings defaults;
  EXPECT_EQ(config.strategy, "robust");
  EXPECT_EQ(config.settings.rules.push_speed, defaults.rules.push_speed);
  EXPECT_EQ(config.settings.rules.border_margin_hit, defaults.rules.border_margin_hit);
  EXPECT_EQ(config.settings.rules.hit_speed_max, defaults.rules.hit_speed_max);
  EXPECT_EQ(config.settings.cell.hit_lift, defaults.cell.hit_lift);
  EXPECT_EQ(config.settings.cell.world.touch_gap, defaults.cell.world.touch_gap);
  EXPECT_EQ(config.settings.cell.p_WB, defaults.cell.p_WB);
  EXPECT_EQ(config.settings.robust.worlds, defaults.robust.worlds);
  EXPECT_EQ(config.settings.robust.rollouts, defaults.robust.rollouts);
  EXPECT_EQ(config.settings.robust.pair_time, defaults.robust.pair_time);
  EXPECT_NEAR(config.settings.robust.aim_spread, defaults.robust.aim_spread, 1e-4);
  EXPECT_EQ(config.task.resend, task::TaskSettings{}.resend);
}

TEST(PlannerConfig, RefusesWhatCannotBe) {
  for (const char* wrong :
       {"planner.strategy=clairvoyant", "planner.robust.worlds=0", "planner.knowledge.impact_law=newton", "planner.knowledge.friction=.nan",
        "planner.knowledge.restitution=1.2", "planner.rules.hit_speed_max=0.1", "planner.rules.alternatives=0",
        "planner.task.settled_scenes=0", "planner.knowledge.striker_area={min: [0.1, 0.1], max: [-0.1, 0.2]}"}) {
    EXPECT_THROW(load({wrong}), ConfigError) << wrong;
  }
}

}  // namespace
}  // namespace breakshot::planner
