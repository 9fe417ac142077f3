#pragma once

#include "sim_bridge/camera/camera_settings.hpp"
#include "sim_bridge/camera/mesh.hpp"

namespace breakshot::sim_bridge {

/// Adds a marker's squares to what is drawn of the table, and marks the tiles that it covers.
void add_marker(const MarkerPrint& marker, const Projector& projector, SceneMesh& table, TileGrid& tiles);

}  // namespace breakshot::sim_bridge
