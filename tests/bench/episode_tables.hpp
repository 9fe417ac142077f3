#pragma once

#include "tests/bench/episodes.hpp"

#include <nlohmann/json.hpp>

#include <vector>

namespace breakshot::bench {

/// Where the discs truly stood before each stroke and at the end, and what each stroke was: for pictures of single episodes. One object per episode:
///
///     {"formation", "index", "strategy", "success", "ended" (text of the phase, or of the failure), "time_s", "region_m" [x_min, x_max, y_min, y_max],
///      "steps": [{"discs": [disc ...], "stroke": {"kind", "p_WS_m", "direction_W", "speed_mps", "length_m"}, "predicted_p_WD_m": [[x, y] ...]}],
///      "end": [disc ...]}, a disc being {"p_WD_m", "radius_m", "rgb", "on_table"}; all in W.
nlohmann::json episode_tables(const std::vector<EpisodeRecord>& records, const CellConfig& cell);

}  // namespace breakshot::bench
