// ./breakshot calibrate from pictures in a folder to a file that the cell reads.

#include "common/config/camera_file.hpp"
#include "common/config/cell_config.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "tests/perception/board_image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

namespace breakshot::perception::test {
namespace {

using ::testing::HasSubstr;

class CalibrateProgram : public ::testing::Test {
 protected:
  CalibrateProgram() {
    std::filesystem::create_directories(folder / "pictures");
    truth = load_camera(cell.camera_file);
    truth.X_WC.translation() += Vector3{0.012, -0.007, 0.004};
    truth.X_WC.rotate(Eigen::AngleAxisd{0.02, Vector3{0.6, -0.5, 0.6}.normalized()});
  }
  ~CalibrateProgram() override { std::filesystem::remove_all(folder); }

  // What the program says, with its exit status in the last line.
  std::string run(const std::string& arguments) const {
    const std::string command =
        "cd " BREAKSHOT_SOURCE_DIR " && " BREAKSHOT_BINARY_DIR "/bin/breakshot-calibrate " + arguments + " 2>&1; echo exit status $?";
    std::string said;
    FILE* pipe = popen(command.c_str(), "r");
    std::array<char, 512> line{};
    while (std::fgets(line.data(), static_cast<int>(line.size()), pipe) != nullptr) said += line.data();
    pclose(pipe);
    return said;
  }
  void save(const std::string& name, const cv::Mat1b& grey) const {
    cv::Mat3b colour;
    cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
    ASSERT_TRUE(cv::imwrite((folder / "pictures" / name).string(), colour));
  }
  void expect_found() const {
    const CameraModel found = load_camera(folder / "camera.yaml");
    EXPECT_LT((found.X_WC.translation() - truth.X_WC.translation()).norm(), 0.3e-3);
    EXPECT_LT(Eigen::AngleAxisd{Matrix3{found.X_WC.linear().transpose() * truth.X_WC.linear()}}.angle(), 5e-4);
  }
  std::string in(const std::string& name) const { return (folder / name).string(); }

  CellConfig cell = load_cell_config(load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml"));
  CameraModel truth;
  std::filesystem::path folder = std::filesystem::path{testing::TempDir()} / ("breakshot_calibrate_" + std::to_string(getpid()));
};

TEST_F(CalibrateProgram, FromABoardOnTheTableInSeveralPlaces) {
  const Board board = load_board(BREAKSHOT_SOURCE_DIR "/config/boards/table_a3.yaml");
  const BoardPainter painter{board};
  std::ofstream places{folder / "places.yaml"};
  places << "pictures:\n";
  int number = 0;
  for (const double dx : {-0.12, 0.0, 0.12}) {
    for (const double dy : {-0.03, 0.03}) {
      const std::string name = std::to_string(++number) + ".png";
      Pose X_WP{Pose::Identity()};
      X_WP.translation() << board.X_WP.translation().head<2>() + Vector2{dx, dy}, 0.0;
      save(name, painter.paint(truth, X_WP, static_cast<std::uint64_t>(number)));
      places << "  - {image: " << name << ", p_WP: [" << X_WP.translation().x() << ", " << X_WP.translation().y() << ", 0], yaw_deg: 0}\n";
    }
  }
  places.close();
  const std::string said = run("--images " + in("pictures") + " --places " + in("places.yaml") + " --out " + in("camera.yaml"));
  EXPECT_THAT(said, HasSubstr("exit status 0"));
  EXPECT_THAT(said, HasSubstr("3.png"));
  EXPECT_THAT(said, HasSubstr("px RMS over all"));
  expect_found();

  // One of them does not show a board.
  save("7.png", cv::Mat1b(720, 1280, std::uint8_t{100}));
  std::filesystem::remove(folder / "camera.yaml");
  EXPECT_THAT(run("--images " + in("pictures") + " --out " + in("camera.yaml")), HasSubstr("refused: 7.png: the board was not found"));
  EXPECT_FALSE(std::filesystem::exists(folder / "camera.yaml"));
}

TEST_F(CalibrateProgram, FromABoardAtTheArm) {
  const Board board = load_board(BREAKSHOT_SOURCE_DIR "/config/boards/striker_a5.yaml");
  const BoardPainter painter{board};
  const kinematics::ArmKinematics kinematics{load_cell_arm(cell), cell.arm.X_WB};
  const kinematics::InverseKinematics inverse{kinematics};
  Pose X_TP{Pose::Identity()};  // facing up while the tip points down
  X_TP.linear() = Eigen::AngleAxisd{std::numbers::pi, Vector3::UnitX()}.toRotationMatrix();
  X_TP.translation() << -0.09, 0.07, 0.02;
  SplitMix64 random{8};
  std::ofstream joints{folder / "joints.yaml"};
  joints.precision(9);
  joints << "pictures:\n";
  for (int number = 0; number < 10;) {
    Pose X_WT{Pose::Identity()};
    X_WT.translation() << random.uniform(-0.25, 0.25), random.uniform(-0.15, 0.15), random.uniform(0.08, 0.25);
    X_WT.linear() = (Eigen::AngleAxisd{random.uniform(-0.6, 0.6), Vector3::UnitZ()} *
                     Eigen::AngleAxisd{std::numbers::pi + random.uniform(-0.4, 0.4), Vector3::UnitX()} *
                     Eigen::AngleAxisd{random.uniform(-0.4, 0.4), Vector3::UnitY()})
                        .toRotationMatrix();
    const auto solutions = inverse.solve(X_WT, cell.arm.park);
    const auto corner = truth.project(X_WT * X_TP * Vector3{0.19, 0.126, 0.0}), origin = truth.project(X_WT * X_TP * Vector3::Zero());
    const auto in_view = [](const Vector2& p) { return p.x() > 0.0 && p.y() > 0.0 && p.x() < 1279.0 && p.y() < 719.0; };
    if (solutions.empty() || !corner || !origin || !in_view(*corner) || !in_view(*origin)) continue;
    const std::string name = std::to_string(++number) + ".jpg";
    save(name, painter.paint(truth, X_WT * X_TP, static_cast<std::uint64_t>(number)));
    joints << "  - {image: " << name << ", q_deg: [";
    const JointVector& q = *solutions.begin();
    for (Eigen::Index i = 0; i < q.size(); ++i) joints << (i == 0 ? "" : ", ") << q[i] * 180.0 / std::numbers::pi;
    joints << "]}\n";
  }
  joints.close();
  const std::string arguments =
      "--images " + in("pictures") + " --joints " + in("joints.yaml") + " --board config/boards/striker_a5.yaml --out " + in("camera.yaml");
  const std::string said = run(arguments);
  EXPECT_THAT(said, HasSubstr("exit status 0"));
  EXPECT_THAT(said, HasSubstr("in the tip's frame"));
  expect_found();
}

TEST_F(CalibrateProgram, SaysWhatIsMissing) {
  EXPECT_THAT(run(""), HasSubstr("found no pictures"));
  EXPECT_THAT(run("--images " + in("pictures")), HasSubstr("found no --out"));
  EXPECT_THAT(run("--images " + in("pictures") + " --out " + in("camera.yaml")), HasSubstr("found no .png, .jpg or .jpeg in the folder"));
  EXPECT_THAT(run("--print-board " + in("board.pdf")), HasSubstr("exit status 0"));
  EXPECT_GT(std::filesystem::file_size(folder / "board.pdf"), 10000U);
}

}  // namespace
}  // namespace breakshot::perception::test
