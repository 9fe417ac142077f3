#include "perception/calibrate/marker_places.hpp"

#include <opencv2/aruco.hpp>

#include <algorithm>
#include <cmath>

namespace breakshot::perception {

std::vector<TableMarker> find_markers(const cv::Mat1b& grey, const CameraModel& camera, const TableMarkers& markers) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(static_cast<int>(markers.dictionary)), corners, ids, parameters);
  std::vector<TableMarker> places;
  for (std::size_t k = 0; k < ids.size(); ++k) {
    if (std::none_of(markers.at.begin(), markers.at.end(), [&](const TableMarker& m) { return m.id == ids[k]; })) continue;
    TableMarker place{ids[k], {0.0, 0.0}, 0.0};
    std::array<Vector2, 4> p_W;
    for (std::size_t i = 0; i < 4; ++i) {
      p_W[i] = camera.point_on_plane({corners[k][i].x, corners[k][i].y}, 0.0);
      place.p_WM += 0.25 * p_W[i];
    }
    const Vector2 right = p_W[1] + p_W[2] - p_W[0] - p_W[3];
    place.yaw = std::atan2(right.y(), right.x());
    places.push_back(place);
  }
  std::sort(places.begin(), places.end(), [](const TableMarker& a, const TableMarker& b) { return a.id < b.id; });
  return places;
}

}  // namespace breakshot::perception
