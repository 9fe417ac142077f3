#include "common/config/camera_file.hpp"
#include "common/config/cell_config.hpp"
#include "common/config/formation.hpp"
#include "common/urdf/cell_arm.hpp"
#include "sim_bridge/arm/arm_dynamics.hpp"
#include "sim_bridge/camera/camera.hpp"
#include "sim_bridge/camera/lighting.hpp"
#include "sim_bridge/sim_bridge_config.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

struct Options {
  std::string config = "config/cell.yaml";
  std::vector<std::string> overrides;
  std::string formation;  ///< empty: the one in the configuration
  std::filesystem::path out = ".";
  std::vector<double> joints_deg;  ///< empty: the park pose
  std::filesystem::path sheet;     ///< image file; empty: none
  std::string lighting;            ///< preset; empty: the configuration's
  double time = 0.0;               ///< of the world, s: for light that changes
  std::uint64_t frame = 1;
};

JointVector joint_pose(const Options& options, const CellConfig& cell) {
  if (options.joints_deg.empty()) return cell.arm.park;
  if (static_cast<Eigen::Index>(options.joints_deg.size()) != cell.arm.park.size()) {
    throw CameraError{fmt::format("--joints: found {} angles; allowed {}, one per joint", options.joints_deg.size(), cell.arm.park.size())};
  }
  JointVector q(cell.arm.park.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = options.joints_deg[static_cast<std::size_t>(i)] * std::numbers::pi / 180.0;
  return q;
}

WorldSnapshot make_snapshot(const Formation& formation, const SimBridgeConfig& config, const CellConfig& cell, const ArmDescription& arm,
                            const JointVector& q) {
  WorldSnapshot snapshot;
  for (const SimDisc& disc : discs_of(formation, config, cell)) {
    DiscState state;
    state.p_WD = disc.p_WD;
    state.radius = disc.radius;
    state.height = disc.height;
    state.mass = disc.mass;
    state.colour = disc.colour;
    snapshot.discs.push_back(state);
  }
  const ArmPosture posture = ArmDynamics{arm, cell.arm.X_WB, 0.1}.posture(q);
  snapshot.X_WL.assign(posture.X_WL.begin(), posture.X_WL.begin() + posture.joints);
  return snapshot;
}

nlohmann::json describe(const Formation& formation, const WorldSnapshot& snapshot, const CellConfig& cell, const CameraModel& model) {
  nlohmann::json truth;
  truth["formation"] = formation.name;
  truth["camera"] = {{"width", model.width}, {"height", model.height},        {"fx", model.fx}, {"fy", model.fy}, {"cx", model.cx},
                     {"cy", model.cy},       {"distortion", model.distortion}};
  const Vector3 p_WC = model.X_WC.translation();
  truth["camera"]["p_WC"] = {p_WC.x(), p_WC.y(), p_WC.z()};
  for (const DiscState& disc : snapshot.discs) {
    nlohmann::json entry = {{"p_WD", {disc.p_WD.x(), disc.p_WD.y()}},
                            {"radius", disc.radius},
                            {"height", disc.height},
                            {"colour", cell.colours.at(disc.colour).name}};
    if (const auto pixel = model.project({disc.p_WD.x(), disc.p_WD.y(), disc.height})) entry["top_centre_px"] = {pixel->x(), pixel->y()};
    truth["discs"].push_back(entry);
  }
  truth["gaps"] = nlohmann::json::array();
  for (std::size_t a = 0; a < snapshot.discs.size(); ++a) {
    for (std::size_t b = a + 1; b < snapshot.discs.size(); ++b) {
      const DiscState &first = snapshot.discs[a], &second = snapshot.discs[b];
      const double gap = (first.p_WD - second.p_WD).norm() - first.radius - second.radius;
      if (gap < 2.0 * cell.target_gap) truth["gaps"].push_back({{"a", a}, {"b", b}, {"gap", gap}});
    }
  }
  return truth;
}

void write_image(const std::filesystem::path& file, const cv::Mat& image) {
  if (!cv::imwrite(file.string(), image))
    throw CameraError{"cannot write " + file.string() + "; is there such a folder, and may you write to it?"};
  fmt::print("{}\n", file.string());
}

/// Depth for people: near is light, far is dark, no measurement is black.
cv::Mat depth_for_people(const cv::Mat& depth) {
  double nearest = 0.0, farthest = 0.0;
  cv::minMaxLoc(depth, &nearest, &farthest, nullptr, nullptr, depth > 0);
  cv::Mat grey, coloured;
  const double scale = -200.0 / std::max(farthest - nearest, 1.0);
  depth.convertTo(grey, CV_8U, scale, 255.0 - scale * nearest);
  cv::applyColorMap(grey, coloured, cv::COLORMAP_VIRIDIS);
  coloured.setTo(cv::Scalar::all(0), depth == 0);
  return coloured;
}

/// Whole millimetres, as RealSense cameras give them.
cv::Mat in_millimetres(const cv::Mat& depth) {
  cv::Mat millimetres;
  depth.convertTo(millimetres, CV_16U, 0.1);
  return millimetres;
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file{path};
  file << text;
  if (!file.flush()) throw CameraError{"cannot write " + path.string()};
  fmt::print("{}\n", path.string());
}

/// A calibration file as config/cameras has them.
std::string camera_yaml(const CameraModel& model) {
  const Vector3 p = model.X_WC.translation(), forward = model.X_WC.linear().col(2), right = model.X_WC.linear().col(0);
  const auto list = [](const auto& values) { return fmt::format("[{}]", fmt::join(values, ", ")); };
  const auto vector = [&](const Vector3& v) { return list(std::array{v.x(), v.y(), v.z()}); };
  return fmt::format(
      "camera:\n  width: {}\n  height: {}\n  fx: {}\n  fy: {}\n  cx: {}\n  cy: {}\n  distortion: {}\n  p_WC: {}\n  looks_along_W: {}\n"
      "  image_x_along_W: {}\n",
      model.width, model.height, model.fx, model.fy, model.cx, model.cy, list(model.distortion), vector(p), vector(forward), vector(right));
}

/// What a picture is taken of, and with what.
struct Studio {
  CellConfig cell;
  SimBridgeConfig config;
  ArmDescription arm;
  Formation formation;
  WorldSnapshot snapshot;
  CameraModel model;
};

Studio prepare(const Options& options) {
  const ConfigDocument document = load_cell_document(options.config, options.overrides);
  Studio studio;
  studio.cell = load_cell_config(document);
  studio.config = load_sim_bridge_config(document, studio.cell);
  studio.arm = load_cell_arm(studio.cell);
  studio.formation = load_formation(options.formation.empty() ? studio.config.formation : options.formation, studio.cell);
  studio.snapshot = make_snapshot(studio.formation, studio.config, studio.cell, studio.arm, joint_pose(options, studio.cell));
  studio.snapshot.stamp = Time{from_seconds(options.time)};
  studio.model = load_camera(studio.cell.camera_file);
  return studio;
}

struct Picture {
  cv::Mat bgr, depth;
};

Picture take(const Studio& studio, const CameraSettings& settings, std::uint64_t frame) {
  Camera camera{studio.model, settings, studio.arm, studio.cell.arm.X_WB};
  const CameraModel& model = studio.model;
  // Round brackets: in braces these would be three pixels.
  cv::Mat rgb(model.height, model.width, CV_8UC3), depth(model.height, model.width, CV_16UC1), bgr;
  const auto pixels = static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
  camera.render(studio.snapshot, frame, {rgb.ptr<std::uint8_t>(), 3 * pixels}, {depth.ptr<std::uint16_t>(), pixels});
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  return {bgr, depth};
}

/// The same scene under every preset, small, side by side.
void render_sheet(const Options& options) {
  constexpr int kColumns = 3;
  const cv::Size small{480, 270};
  const Studio studio = prepare(options);
  const std::vector<std::string> names = lighting_names(studio.config.lighting_folder);
  const int rows = (static_cast<int>(names.size()) + kColumns - 1) / kColumns;
  cv::Mat sheet(rows * small.height, kColumns * small.width, CV_8UC3, cv::Scalar::all(0));
  for (int i = 0; i < static_cast<int>(names.size()); ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    CameraSettings settings = studio.config.camera;
    apply_lighting(studio.config.lighting_folder, name, settings);
    cv::Mat part = sheet(cv::Rect{cv::Point{i % kColumns * small.width, i / kColumns * small.height}, small});
    cv::resize(take(studio, settings, options.frame).bgr, part, small, 0.0, 0.0, cv::INTER_AREA);
    cv::putText(part, name, {10, 24}, cv::FONT_HERSHEY_SIMPLEX, 0.7, cv::Scalar::all(0), 3, cv::LINE_AA);
    cv::putText(part, name, {10, 24}, cv::FONT_HERSHEY_SIMPLEX, 0.7, cv::Scalar::all(255), 1, cv::LINE_AA);
  }
  write_image(options.sheet, sheet);
}

void render(const Options& options) {
  const Studio studio = prepare(options);
  CameraSettings settings = studio.config.camera;
  if (!options.lighting.empty()) apply_lighting(studio.config.lighting_folder, options.lighting, settings);
  const Picture picture = take(studio, settings, options.frame);
  std::filesystem::create_directories(options.out);
  write_image(options.out / "color.png", picture.bgr);
  write_image(options.out / "depth.png", picture.depth);
  write_image(options.out / "depth_mm.png", in_millimetres(picture.depth));
  write_image(options.out / "depth_view.png", depth_for_people(picture.depth));
  write_text(options.out / "camera.yaml", camera_yaml(studio.model));
  nlohmann::json truth = describe(studio.formation, studio.snapshot, studio.cell, studio.model);
  truth["lighting"] = options.lighting.empty() ? "as configured" : options.lighting;
  truth["time"] = options.time;
  write_text(options.out / "truth.json", truth.dump(2) + "\n");
}

}  // namespace
}  // namespace breakshot::sim_bridge

int main(int argc, char** argv) {
  breakshot::sim_bridge::Options options;
  CLI::App app{
      "Renders what the simulated camera sees of a formation: color.png, depth.png (0.1 mm, as ./breakshot perceive takes it), "
      "depth_mm.png, "
      "depth_view.png (for people), camera.yaml, and truth.json: the discs in W, and the gaps of pairs nearer than twice cell.target_gap."};
  app.add_option("--config", options.config, "configuration of the cell")->capture_default_str();
  app.add_option("--set", options.overrides, "section.key=value: replaces a value of the configuration")->allow_extra_args(false);
  app.add_option("--formation", options.formation, "name in config/formations, or random:n=6,seed=3 (default: the configuration's)");
  app.add_option("--out", options.out, "folder for the files; made if need be")->capture_default_str();
  app.add_option("--joints", options.joints_deg, "joint angles of the arm in degrees, separated by commas (default: the park pose)")
      ->delimiter(',');
  app.add_option("--lighting", options.lighting, "preset in config/lighting (default: the configuration's light)");
  app.add_option("--time", options.time, "of the world, s: where drifting light and the moving shadow are")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--frame", options.frame, "number of the frame: another number, other noise")->capture_default_str();
  app.add_option("--sheet", options.sheet, "instead of all that: an image file for the scene under every preset, side by side");
  CLI11_PARSE(app, argc, argv);
  try {
    if (options.sheet.empty()) {
      breakshot::sim_bridge::render(options);
    } else {
      breakshot::sim_bridge::render_sheet(options);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "breakshot-render: {}\n", error.what());
    return 1;
  }
  return 0;
}
