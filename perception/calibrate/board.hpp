#pragma once

#include "common/config/config_node.hpp"
#include "common/geometry.hpp"
#include "common/table_markers.hpp"

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace breakshot::perception {

/// A ChArUco board: a chessboard with markers in its white squares, which say which corner is which (config/boards/*.yaml).
///
/// Its frame P has its origin in the lower left corner of the chessboard as the print is read, x to the right, y up, z out of the paper.
struct Board {
  MarkerDictionary dictionary = MarkerDictionary::k5x5;
  int columns = 0, rows = 0;    ///< of squares
  double square = 0.0;          ///< side, m
  double marker = 0.0;          ///< side of a marker's black square, m
  Pose X_WP{Pose::Identity()};  ///< where it lies on the table

  int corners() const noexcept { return (columns - 1) * (rows - 1); }
};

/// Reads a board's file. @throws ConfigError
Board load_board(const std::filesystem::path& file);
/// Where a board lies, X_WP: `p_WP` and `yaw_deg` of a map. @throws ConfigError
Pose read_place(const ConfigNode& node);

/// A rectangle of ink, in P, m.
struct Ink {
  Vector2 low, high;
};
/// All that is black of a board.
std::vector<Ink> ink_of(const Board& board);

/// Writes a board for printing, by the name's ending: .pdf in its true size (with a line to check that), .png at 600 dots per inch.
/// @throws std::runtime_error when it cannot be written, or ends in neither
void print_board(const Board& board, const std::filesystem::path& file);

/// What one picture shows of a board: corners by their places on it and in the image.
struct BoardView {
  std::string picture;
  std::vector<Vector3> p_P;      ///< m
  std::vector<Vector2> p_pixel;  ///< px
  int markers = 0;               ///< that were read
};

/// Finds a board's corners.
class BoardDetector {
 public:
  explicit BoardDetector(const Board& board);

  /// @param grey  of 8 bits
  BoardView find(const cv::Mat1b& grey, const std::string& picture) const;

 private:
  // Side of a square in the image, where it is smallest; 0 when no two neighbours are there.
  double square_px(const std::vector<cv::Point2f>& corners, const std::vector<int>& ids) const;

  Board board_;
  cv::Ptr<cv::aruco::CharucoBoard> charuco_;
  cv::Ptr<cv::aruco::DetectorParameters> parameters_;
};

}  // namespace breakshot::perception
