#include "perception/calibrate/board.hpp"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <numbers>
#include <string>

namespace breakshot::perception {
namespace {

cv::Ptr<cv::aruco::CharucoBoard> make_charuco(const Board& board) {
  return cv::aruco::CharucoBoard::create(board.columns, board.rows, static_cast<float>(board.square), static_cast<float>(board.marker),
                                         cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary)));
}

}  // namespace

Pose read_place(const ConfigNode& node) {
  Pose X_WP{Pose::Identity()};
  X_WP.translation() = node.vector3("p_WP", {-3.0, 3.0});
  X_WP.rotate(Eigen::AngleAxisd{node.number("yaw_deg", {-180.0, 180.0}, "deg") * std::numbers::pi / 180.0, Vector3::UnitZ()});
  return X_WP;
}

Board load_board(const std::filesystem::path& file) {
  const ConfigDocument document = ConfigDocument::load(file);
  const ConfigNode node = document.section("board");
  Board board;
  std::vector<std::string> names;
  for (const auto& each : kMarkerDictionaries) names.emplace_back(each.name);
  const std::string name = node.choice("dictionary", names);
  const auto& family = *std::find_if(kMarkerDictionaries.begin(), kMarkerDictionaries.end(), [&](const auto& d) { return d.name == name; });
  board.dictionary = family.dictionary;
  const Vector2 squares = node.vector2("squares", {3.0, 60.0}, "");
  board.columns = static_cast<int>(squares.x());
  board.rows = static_cast<int>(squares.y());
  if (squares != Vector2(board.columns, board.rows)) node.refuse("squares", "a fraction", "two whole numbers");
  if (board.columns * board.rows / 2 > family.markers) {
    node.refuse("squares", std::to_string(board.columns * board.rows / 2) + " markers",
                "at most the " + std::to_string(family.markers) + " of " + name);
  }
  board.square = node.number("square", {0.005, 0.5}, "m");
  board.marker = node.number("marker", {0.002, 0.5}, "m");
  // A marker that fills its square has no white around it, and is not found.
  if (board.marker > 0.9 * board.square || board.marker < 0.4 * board.square) {
    node.refuse("marker", std::to_string(board.marker), "0.4 to 0.9 times `square`");
  }
  board.X_WP = read_place(node);
  document.root().finish();
  return board;
}

std::vector<Ink> ink_of(const Board& board) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(board.dictionary));
  const int bits = dictionary->markerSize;
  std::vector<Ink> ink;
  int id = 0;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const Vector2 low{column * board.square, (board.rows - 1 - row) * board.square};
      if (row % 2 == column % 2) {
        ink.push_back({low, low + Vector2::Constant(board.square)});
        continue;
      }
      const cv::Mat1b code = cv::aruco::Dictionary::getBitsFromByteList(dictionary->bytesList.row(id++), bits);
      const double bit = board.marker / (bits + 2);
      const Vector2 top_left = low + Vector2{0.5 * (board.square - board.marker), 0.5 * (board.square + board.marker)};
      for (int r = 0; r < bits + 2; ++r) {
        for (int c = 0; c < bits + 2; ++c) {
          const bool border = r == 0 || c == 0 || r == bits + 1 || c == bits + 1;
          if (!border && code(r - 1, c - 1) != 0) continue;
          const Vector2 corner = top_left + bit * Vector2{c, -r};
          ink.push_back({corner - Vector2{0.0, bit}, corner + Vector2{bit, 0.0}});
        }
      }
    }
  }
  return ink;
}

BoardDetector::BoardDetector(const Board& board)
    : board_{board}, charuco_{make_charuco(board)}, parameters_{cv::aruco::DetectorParameters::create()} {}

double BoardDetector::square_px(const std::vector<cv::Point2f>& corners, const std::vector<int>& ids) const {
  double smallest = 1e9;
  for (std::size_t i = 0; i + 1 < ids.size(); ++i) {
    const bool beside = ids[i + 1] == ids[i] + 1 && ids[i + 1] % (board_.columns - 1) != 0;
    if (beside) smallest = std::min(smallest, cv::norm(corners[i + 1] - corners[i]));
  }
  return smallest < 1e9 ? smallest : 0.0;
}

BoardView BoardDetector::find(const cv::Mat1b& grey, const std::string& picture) const {
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, charuco_->dictionary, markers, ids, parameters_);
  BoardView view{picture, {}, {}, static_cast<int>(ids.size())};
  if (ids.empty()) return view;
  std::vector<cv::Point2f> corners;
  std::vector<int> corner_ids;
  cv::aruco::interpolateCornersCharuco(markers, ids, grey, charuco_, corners, corner_ids);
  if (corner_ids.empty()) return view;
  // OpenCV gives these, unlike all other corners, with the origin at the edge of the first pixel and not in its middle.
  for (cv::Point2f& corner : corners) corner -= cv::Point2f{0.5F, 0.5F};
  // And refines them in a window that reaches the markers nearby, which pull. Once more, in one that does not: 0.04 instead of 0.06 px.
  const int half = std::clamp(static_cast<int>(0.8 * 0.5 * (1.0 - board_.marker / board_.square) * square_px(corners, corner_ids)), 2, 8);
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1}, {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 50, 1e-3});
  for (std::size_t i = 0; i < corner_ids.size(); ++i) {
    const int column = corner_ids[i] % (board_.columns - 1), row = corner_ids[i] / (board_.columns - 1);
    view.p_P.emplace_back((column + 1) * board_.square, (board_.rows - 1 - row) * board_.square, 0.0);
    view.p_pixel.emplace_back(corners[i].x, corners[i].y);
  }
  return view;
}

}  // namespace breakshot::perception
