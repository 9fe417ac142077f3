#pragma once

#include "client/demo/observer.hpp"
#include "mes_gateway/protocol/messages.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace breakshot::client {

/// All that a run came to. Images are written as they come and are not kept here.
struct RunRecord {
  std::string formation;  ///< as asked on the command line; for the record only
  std::string strategy;
  double target_gap = 0.0;  ///< m
  Rect workspace;
  std::vector<DecisionRecord> decisions;  ///< without frames
  std::optional<TaskStatus> task;
  std::optional<mes::JobState> job;
  std::optional<SimTruth> truth;  ///< after the run, for scoring
  std::map<std::string, Health> healths;
  double scene_rate = 0.0;  ///< 1/s
  Duration wall{};          ///< from the order to its end
};

/// Whether the run did what was asked: the order ENDED, and by the simulator's truth, where there is one, no disc left the workspace.
bool succeeded(const RunRecord& run);

/// "#3 push 0.10 m/s at (0.05, -0.02) 40 deg ...": a stroke when it is decided.
std::string decision_line(std::size_t index, const Plan& plan);
/// What became of it, beside what was predicted.
std::string outcome_line(const Plan& plan, const Outcome& outcome);
/// The table at the end.
std::string summary(const RunRecord& run);
/// Everything, for machines.
nlohmann::json to_json(const RunRecord& run);

}  // namespace breakshot::client
