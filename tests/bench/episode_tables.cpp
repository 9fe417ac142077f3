#include "tests/bench/episode_tables.hpp"

namespace breakshot::bench {

namespace {

nlohmann::json pair_of(const Vector2& v) { return {v.x(), v.y()}; }

nlohmann::json discs_of(const std::vector<SimDisc>& discs, const CellConfig& cell) {
  nlohmann::json all = nlohmann::json::array();
  for (const SimDisc& disc : discs) {
    all.push_back({{"p_WD_m", pair_of(disc.p_WD)},
                   {"radius_m", disc.radius},
                   {"rgb", cell.colours.at(disc.colour).rgb},
                   {"on_table", disc.on_table}});
  }
  return all;
}

nlohmann::json step_of(const Plan& plan, const std::vector<SimDisc>& discs, const CellConfig& cell) {
  nlohmann::json predicted = nlohmann::json::array();
  for (const Vector2& p_WD : plan.predicted_p_WD) predicted.push_back(pair_of(p_WD));
  const StrokeRequest& stroke = plan.stroke;
  return {{"discs", discs_of(discs, cell)},
          {"stroke",
           {{"kind", to_string(stroke.kind)},
            {"p_WS_m", pair_of(stroke.p_WS)},
            {"direction_W", pair_of(stroke.direction_W)},
            {"speed_mps", stroke.speed},
            {"length_m", stroke.length}}},
          {"predicted_p_WD_m", predicted}};
}

}  // namespace

nlohmann::json episode_tables(const std::vector<EpisodeRecord>& records, const CellConfig& cell) {
  nlohmann::json episodes = nlohmann::json::array();
  for (const EpisodeRecord& record : records) {
    const support::EpisodeResult& result = record.result;
    nlohmann::json steps = nlohmann::json::array();
    for (std::size_t i = 0; i < result.plans.size(); ++i) steps.push_back(step_of(result.plans[i], result.tables[i], cell));
    const TaskStatus& task = result.task;
    episodes.push_back({{"formation", record.spec.formation},
                        {"index", record.spec.index},
                        {"strategy", record.spec.strategy},
                        {"success", record.success},
                        {"ended", task.failure == TaskFailure::kNone ? to_string(task.phase) : to_string(task.failure)},
                        {"time_s", to_seconds(result.duration)},
                        {"region_m", {cell.workspace.min.x(), cell.workspace.max.x(), cell.workspace.min.y(), cell.workspace.max.y()}},
                        {"steps", steps},
                        {"end", discs_of(result.truth, cell)}});
  }
  return episodes;
}

}  // namespace breakshot::bench
