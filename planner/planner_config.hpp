#pragma once

#include "common/config/cell_config.hpp"
#include "common/config/config_node.hpp"
#include "planner/estimate/table_estimate.hpp"
#include "planner/strategy/settings.hpp"
#include "planner/task/task_settings.hpp"

#include <string>

namespace breakshot::planner {

/// All that the planner is told.
struct PlannerConfig {
  std::string strategy;  ///< one of strategy::strategy_names()
  strategy::StrategySettings settings;
  estimate::EstimateSettings estimate;
  bool learn = true;  ///< whether strategies are told what the strokes so far taught
  task::TaskSettings task;
  bool ask_arm = true;       ///< whether strokes are tried on the arm's own planner before they are sent
  Duration clock_silence{};  ///< lockstep: wall time without a new stamp after which a task is given up
};

/// Reads section `planner`, with what section `cell` says of table, striker and arm.
/// @throws ConfigError
PlannerConfig load_planner_config(const ConfigDocument& document, const CellConfig& cell);

}  // namespace breakshot::planner
