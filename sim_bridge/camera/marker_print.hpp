#pragma once

#include "common/table_markers.hpp"
#include "sim_bridge/camera/camera_settings.hpp"

#include <vector>

namespace breakshot::sim_bridge {

/// The prints of a cell's markers, each with a white margin of one square.
std::vector<MarkerPrint> marker_prints(const TableMarkers& markers);

}  // namespace breakshot::sim_bridge
