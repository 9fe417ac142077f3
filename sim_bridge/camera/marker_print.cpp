#include "sim_bridge/camera/marker_print.hpp"

#include <opencv2/aruco/dictionary.hpp>

namespace breakshot::sim_bridge {

std::vector<MarkerPrint> marker_prints(const TableMarkers& markers) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(markers.dictionary));
  const int bits = dictionary->markerSize;
  std::vector<MarkerPrint> prints;
  for (const TableMarker& marker : markers.at) {
    const cv::Mat1b code = cv::aruco::Dictionary::getBitsFromByteList(dictionary->bytesList.row(marker.id), bits);
    MarkerPrint print{marker.p_WM, marker.yaw, markers.side / (bits + 2), bits + 4, {}};
    for (int row = 0; row < print.squares; ++row) {
      for (int column = 0; column < print.squares; ++column) {
        const int last = print.squares - 1;
        const bool margin = row == 0 || column == 0 || row == last || column == last;
        const bool border = row == 1 || column == 1 || row == last - 1 || column == last - 1;
        print.white.push_back(margin || (!border && code(row - 2, column - 2) != 0));
      }
    }
    prints.push_back(std::move(print));
  }
  return prints;
}

}  // namespace breakshot::sim_bridge
