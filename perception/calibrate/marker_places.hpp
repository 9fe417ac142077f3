#pragma once

#include "common/camera_model.hpp"
#include "common/table_markers.hpp"

#include <opencv2/core.hpp>

#include <vector>

namespace breakshot::perception {

/// Where the table's markers are as a calibrated camera sees them, by their ids; only those that `markers` has and the picture shows.
std::vector<TableMarker> find_markers(const cv::Mat1b& grey, const CameraModel& camera, const TableMarkers& markers);

}  // namespace breakshot::perception
