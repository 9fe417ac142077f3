#include "perception/calibrate/board.hpp"

#include "common/config/config_node.hpp"
#include "perception/calibrate/picture_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>

namespace breakshot::perception {
namespace {

using ::testing::HasSubstr;

class BoardTest : public ::testing::Test {
 protected:
  BoardTest() { std::filesystem::create_directories(folder); }
  ~BoardTest() override { std::filesystem::remove_all(folder); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream{folder / name} << text;
    return folder / name;
  }
  std::string error_with(const std::string& from, const std::string& to) const {
    std::ifstream stream{BREAKSHOT_SOURCE_DIR "/config/boards/table_a3.yaml"};
    std::string text{std::istreambuf_iterator<char>{stream}, {}};
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    try {
      (void)load_board(write("board.yaml", text));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "no error";
  }

  std::filesystem::path folder = std::filesystem::path{testing::TempDir()} / ("breakshot_board_" + std::to_string(getpid()));
};

TEST_F(BoardTest, TheShippedBoardsPrintAndAreFound) {
  for (const std::string name : {"table_a3", "striker_a5"}) {
    const Board board = load_board(BREAKSHOT_SOURCE_DIR "/config/boards/" + name + ".yaml");
    print_board(board, folder / "board.png");
    cv::Mat1b printed = cv::imread((folder / "board.png").string(), cv::IMREAD_GRAYSCALE);
    ASSERT_FALSE(printed.empty());
    const double dots = 600.0 / 0.0254;
    EXPECT_NEAR(printed.cols, (board.columns * board.square + 0.02) * dots, 2.0);
    cv::Mat1b seen;
    constexpr double kScale = 0.15;
    cv::resize(printed, seen, {}, kScale, kScale, cv::INTER_AREA);
    const BoardView view = BoardDetector{board}.find(seen, name);
    ASSERT_EQ(static_cast<int>(view.p_P.size()), board.corners()) << name;
    // P: from the lower left corner, x to the right, y up.
    for (std::size_t i = 0; i < view.p_P.size(); ++i) {
      const double x = (view.p_P[i].x() + 0.01) * dots * kScale - 0.5,
                   y = printed.rows * kScale - (view.p_P[i].y() + 0.01) * dots * kScale - 0.5;
      EXPECT_NEAR(view.p_pixel[i].x(), x, 0.3) << name;
      EXPECT_NEAR(view.p_pixel[i].y(), y, 0.3) << name;
    }
  }
}

// What we take for the board's ink is what OpenCV takes for it.
TEST_F(BoardTest, TheInkIsThatOfOpenCvsOwnDrawing) {
  const Board board{MarkerDictionary::k5x5, 7, 5, 0.028, 0.021, Pose::Identity()};
  const auto charuco = cv::aruco::CharucoBoard::create(7, 5, 0.028F, 0.021F, cv::aruco::getPredefinedDictionary(5));
  cv::Mat1b theirs;
  charuco->draw({7 * 280, 5 * 280}, theirs);
  cv::Mat1b ours(theirs.size(), std::uint8_t{255});
  for (const Ink& ink : ink_of(board)) {
    const auto dot = [](double length) { return static_cast<int>(std::lround(1e4 * length)); };
    ours(cv::Rect{cv::Point{dot(ink.low.x()), ours.rows - dot(ink.high.y())}, cv::Point{dot(ink.high.x()), ours.rows - dot(ink.low.y())}}) =
        std::uint8_t{0};
  }
  EXPECT_LT(cv::countNonZero(ours != theirs), 0.002 * static_cast<double>(ours.total())) << "but for rounding at the edges";
}

TEST_F(BoardTest, ThePdfHasItsTrueSizeAndIsWhole) {
  const Board board = load_board(BREAKSHOT_SOURCE_DIR "/config/boards/table_a3.yaml");
  print_board(board, folder / "board.pdf");
  std::ifstream stream{folder / "board.pdf", std::ios::binary};
  const std::string pdf{std::istreambuf_iterator<char>{stream}, {}};
  EXPECT_TRUE(pdf.starts_with("%PDF-1.4"));
  EXPECT_TRUE(pdf.ends_with("%%EOF\n"));
  std::smatch box;
  ASSERT_TRUE(std::regex_search(pdf, box, std::regex{R"(/MediaBox \[0 0 ([0-9.]+) ([0-9.]+)\])"}));
  EXPECT_NEAR(std::stod(box[1]), (0.396 + 0.02) / 0.0254 * 72.0, 1e-3);
  EXPECT_NEAR(std::stod(box[2]), (0.264 + 0.02) / 0.0254 * 72.0, 1e-3);
  // Every entry of the table points to its object.
  const std::size_t table = pdf.find("xref\n0 6\n");
  ASSERT_NE(table, std::string::npos);
  for (int i = 1; i <= 5; ++i) {
    const std::size_t offset = std::stoul(pdf.substr(table + 9 + 20 * static_cast<std::size_t>(i), 10));
    EXPECT_EQ(pdf.compare(offset, 7, std::to_string(i) + " 0 obj"), 0) << i;
  }
  const std::size_t start = pdf.rfind("startxref\n");
  EXPECT_EQ(std::stoul(pdf.substr(start + 10)), table);
  EXPECT_THROW(print_board(board, folder / "board.doc"), std::runtime_error);
  EXPECT_THROW(print_board(board, folder / "none/board.pdf"), std::runtime_error);
}

TEST_F(BoardTest, RefusesBoardsThatCannotBe) {
  EXPECT_THAT(error_with("squares: [12, 8]", "squares: [12.5, 8]"), HasSubstr("board.squares: found a fraction"));
  EXPECT_THAT(error_with("squares: [12, 8]", "squares: [30, 8]"), HasSubstr("found 120 markers; allowed: at most the 100 of 5x5_100"));
  EXPECT_THAT(error_with("marker: 0.0240", "marker: 0.0330"), HasSubstr("board.marker: found"));
  EXPECT_THAT(error_with("dictionary: 5x5_100", "dictionary: 5x5"), HasSubstr("board.dictionary: found 5x5; allowed: 4x4_50, 5x5_100"));
  EXPECT_THAT(error_with("yaw_deg: 0.0", "yaw: 0.0"), HasSubstr("yaw_deg"));
}

TEST_F(BoardTest, PlacesAreReadByPicture) {
  const auto places = load_places_file(write("places.yaml", "pictures:\n  - {image: a.png, p_WP: [0.1, 0.2, 0.003], yaw_deg: 90}\n"));
  EXPECT_TRUE((places.of("a.png") * Vector3{0.1, 0.0, 0.0}).isApprox(Vector3{0.1, 0.3, 0.003}));
  EXPECT_THROW((void)load_places_file(write("places.yaml", "pictures:\n  - {image: a.png, p_WP: [0.1, 0.2], yaw_deg: 90}\n")), ConfigError);
}

TEST_F(BoardTest, JointsAreReadByPicture) {
  const auto joints =
      load_joints_file(write("joints.yaml", "pictures:\n  - {image: a.png, q_deg: [0, 90]}\n  - {image: b.png, q_deg: [1, 2]}\n"), 2);
  EXPECT_NEAR(joints.of("a.png")[1], 1.5707963, 1e-6);
  EXPECT_THROW((void)joints.of("c.png"), std::runtime_error);
  EXPECT_THROW((void)load_joints_file(write("joints.yaml", "pictures:\n  - {image: a.png, q_deg: [0, 90, 1]}\n"), 2), ConfigError);
  EXPECT_THROW(
      (void)load_joints_file(write("joints.yaml", "pictures:\n  - {image: a.png, q_deg: [0, 90]}\n  - {image: a.png, q_deg: [0, 1]}\n"), 2),
      ConfigError);
}

}  // namespace
}  // namespace breakshot::perception
