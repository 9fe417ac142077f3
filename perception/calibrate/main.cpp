// breakshot-calibrate: where a camera is, and if asked what its lens does, from pictures of a ChArUco board.

#include "common/config/camera_file.hpp"
#include "common/config/cell_config.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/kinematics/arm_kinematics.hpp"
#include "perception/calibrate/board.hpp"
#include "perception/calibrate/calibration.hpp"
#include "perception/calibrate/marker_places.hpp"
#include "perception/calibrate/picture_list.hpp"
#include "perception/image_file.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace breakshot::perception {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

struct Options {
  std::vector<std::string> images, free, overrides;
  std::string board = "config/boards/table_a3.yaml", joints, places, camera, out, config = "config/cell.yaml", print, markers;
  CalibrationSettings settings;
};

/// The pictures of a list of files and folders, a folder's by name.
std::vector<std::filesystem::path> pictures(const std::vector<std::string>& names) {
  std::vector<std::filesystem::path> files;
  for (const std::string& name : names) {
    if (!std::filesystem::is_directory(name)) {
      files.emplace_back(name);
      continue;
    }
    std::vector<std::filesystem::path> inside;
    for (const auto& entry : std::filesystem::directory_iterator{name}) {
      if (entry.path().extension() == ".png" || entry.path().extension() == ".jpg" || entry.path().extension() == ".jpeg")
        inside.push_back(entry.path());
    }
    if (inside.empty()) throw std::runtime_error(name + ": found no .png, .jpg or .jpeg in the folder");
    std::sort(inside.begin(), inside.end());
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

cv::Mat1b read_grey(const std::filesystem::path& file, const CameraModel& camera) {
  ColorFrame frame = read_color(file);
  if (frame.width != camera.width || frame.height != camera.height) {
    throw std::runtime_error(fmt::format("{}: found {} x {} px; the camera's file says {} x {}", file.string(), frame.width, frame.height,
                                         camera.width, camera.height));
  }
  cv::Mat1b grey;
  cv::cvtColor(cv::Mat3b{frame.height, frame.width, reinterpret_cast<cv::Vec3b*>(frame.rgb.data())}, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

std::vector<CalibrationView> read_views(const Options& options, const Board& board, const CellConfig& cell, const CameraModel& camera) {
  const BoardDetector detector{board};
  std::vector<CalibrationView> views;
  const auto add = [&](const std::filesystem::path& file, BoardPlace place) -> CalibrationView& {
    return views.emplace_back(
        CalibrationView{detector.find(read_grey(file, camera), file.filename().string()), place, board.X_WP, Pose::Identity()});
  };
  if (!options.places.empty()) {
    const auto places = load_places_file(options.places);
    for (const auto& file : pictures(options.images)) add(file, BoardPlace::kTable).X_WP = places.of(file.filename().string());
  } else if (options.joints.empty()) {
    for (const auto& file : pictures(options.images)) add(file, BoardPlace::kTable);
  } else {
    const kinematics::ArmKinematics kinematics{load_cell_arm(cell), cell.arm.X_WB};
    const auto joints = load_joints_file(options.joints, kinematics.joints());
    for (const auto& file : pictures(options.images))
      add(file, BoardPlace::kArm).X_WT = kinematics.tip_in_world(joints.of(file.filename().string()));
  }
  for (const auto& file : pictures(options.free)) add(file, BoardPlace::kFree);
  return views;
}

void report(const Calibration& result, const CalibrationSettings& settings) {
  fmt::print("{:<40} {:>8} {:>12}\n", "picture", "corners", "RMS px");
  for (const auto& view : result.views) fmt::print("{:<40} {:>8} {:>12.3f}\n", view.picture, view.corners, view.residual);
  const Vector3 p = result.camera.X_WC.translation();
  fmt::print("residual  {:.3f} px RMS over all\n", result.residual);
  fmt::print("pose      p_WC = [{:.5f}, {:.5f}, {:.5f}] m, standard deviation {:.3f} mm and {:.4f} deg along the worst axes\n", p.x(),
             p.y(), p.z(), 1e3 * result.p_sigma, kDegrees * result.turn_sigma);
  if (settings.intrinsics) {
    fmt::print("lens      f = {:.2f}, {:.2f} px, c = {:.2f}, {:.2f} px; sure to {:.3f} px (standard deviation) everywhere in the image\n",
               result.camera.fx, result.camera.fy, result.camera.cx, result.camera.cy, result.lens_sigma);
  }
  if (result.X_TP) {
    const Vector3 t = result.X_TP->translation();
    fmt::print("board     its corner is at [{:.2f}, {:.2f}, {:.2f}] mm in the tip's frame\n", 1e3 * t.x(), 1e3 * t.y(), 1e3 * t.z());
  }
}

std::string note_of(const Calibration& result) {
  return fmt::format(
      "Calibrated from {} pictures: residual {:.3f} px RMS; pose known to {:.3f} mm and {:.4f} deg (standard deviation along the worst "
      "axes).",
      result.views.size(), result.residual, 1e3 * result.p_sigma, kDegrees * result.turn_sigma);
}

/// Where the table's markers are as this camera sees them, to be put into cell.yaml.
void print_markers(const Options& options, const CellConfig& cell, const CameraModel& camera) {
  const auto places = find_markers(read_grey(options.markers, camera), camera, cell.table_markers);
  if (places.empty()) throw std::runtime_error(options.markers + ": found none of the table's markers (cell.table_markers)");
  fmt::print("    at:\n");
  for (const TableMarker& m : places) {
    fmt::print("      - {{id: {}, p_WM: [{:.5f}, {:.5f}], yaw_deg: {:.2f}}}\n", m.id, m.p_WM.x(), m.p_WM.y(), kDegrees * m.yaw);
  }
}

void run(const Options& options) {
  if (!options.print.empty()) {
    print_board(load_board(options.board), options.print);
    fmt::print("{}: print it at 100 %, check its line with a ruler, glue it to something flat and stiff\n", options.print);
    return;
  }
  cv::setNumThreads(1);
  const CellConfig cell = load_cell_config(load_cell_document(options.config, options.overrides));
  const CameraModel start = load_camera(options.camera.empty() ? cell.camera_file : std::filesystem::path{options.camera});
  if (options.images.empty()) {
    if (options.markers.empty()) throw std::runtime_error("found no pictures; needed: --images (or --print-board, --markers)");
    print_markers(options, cell, start);
    return;
  }
  if (options.out.empty()) throw std::runtime_error("found no --out; needed: the file for the calibration");
  const Board board = load_board(options.board);
  if (board.dictionary == cell.table_markers.dictionary && !cell.table_markers.at.empty()) {
    throw std::runtime_error(options.board +
                             ": found the dictionary of cell.table_markers; needed: another one, or markers are taken for each other");
  }
  const auto result = calibrate(read_views(options, board, cell, start), board, start, options.settings);
  if (!result) throw std::runtime_error("refused: " + result.error().text);
  report(*result, options.settings);
  const std::string text = camera_text(result->camera, note_of(*result));
  (void)parse_camera(text, options.out);  // what the cell would refuse is not written
  std::ofstream file{options.out};
  file << text;
  if (!file.flush()) throw std::runtime_error(options.out + ": cannot be written");
  fmt::print("{}: written; the cell takes it as cell.camera\n", options.out);
  if (!options.markers.empty()) print_markers(options, cell, result->camera);
}

}  // namespace
}  // namespace breakshot::perception

int main(int argc, char** argv) {
  breakshot::perception::Options options;
  CLI::App app{"Calibrates the camera from pictures of a ChArUco board that lies on the table or is held by the arm"};
  app.add_option("--images", options.images, "pictures, or folders of them: PNG or JPEG");
  app.add_option("--free", options.free, "more pictures, of the board held anyhow: they help --intrinsics");
  app.add_option("--board", options.board, "the board (config/boards/)")->capture_default_str()->check(CLI::ExistingFile);
  CLI::Option* places = app.add_option("--places", options.places,
                                       "where the board lay for each picture, if it was moved (default: all where its own file says)")
                            ->check(CLI::ExistingFile);
  app.add_option("--joints", options.joints, "the arm holds the board: joint angles of each picture")
      ->check(CLI::ExistingFile)
      ->excludes(places);
  app.add_flag("--intrinsics", options.settings.intrinsics, "find the lens, too: focal lengths, principal point, distortion");
  app.add_option("--camera", options.camera,
                 "calibration to start from: image size, and the lens if that is not asked for (default: the cell's)")
      ->check(CLI::ExistingFile);
  app.add_option("--out", options.out, "where the calibration goes");
  app.add_option("--markers", options.markers, "a picture of the empty table: prints where its markers are, for cell.table_markers")
      ->check(CLI::ExistingFile);
  app.add_option("--print-board", options.print, "write the board for printing: .pdf (true size) or .png (600 dpi)");
  app.add_option("--max-residual", options.settings.max_residual, "px RMS: more is refused")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 10.0));
  app.add_option("--config", options.config, "cell configuration")->capture_default_str()->check(CLI::ExistingFile);
  app.add_option("--set", options.overrides, "section.key=value: override the configuration")->allow_extra_args(false);
  CLI11_PARSE(app, argc, argv);
  try {
    breakshot::perception::run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "breakshot-calibrate: {}\n", error.what());
    return 1;
  }
  return 0;
}
