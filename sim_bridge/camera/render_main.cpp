#include "common/config/camera_file.hpp"
#include "common/config/cell_config.hpp"
#include "common/config/formation.hpp"
#include "common/urdf/cell_arm.hpp"
#include "sim_bridge/arm/arm_dynamics.hpp"
#include "sim_bridge/camera/camera.hpp"
#include "sim_bridge/sim_bridge_config.hpp"

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
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

void render(const Options& options) {
  const ConfigDocument document = load_cell_document(options.config, options.overrides);
  const CellConfig cell = load_cell_config(document);
  const SimBridgeConfig config = load_sim_bridge_config(document, cell);
  const ArmDescription arm = load_cell_arm(cell);
  const Formation formation = load_formation(options.formation.empty() ? config.formation : options.formation, cell);
  const WorldSnapshot snapshot = make_snapshot(formation, config, cell, arm, joint_pose(options, cell));

  Camera camera{load_camera(cell.camera_file), config.camera, arm, cell.arm.X_WB};
  const CameraModel& model = camera.model();
  // Round brackets: in braces these would be three pixels.
  cv::Mat rgb(model.height, model.width, CV_8UC3), depth(model.height, model.width, CV_16UC1), bgr;
  const auto pixels = static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
  camera.render(snapshot, options.frame, {rgb.ptr<std::uint8_t>(), 3 * pixels}, {depth.ptr<std::uint16_t>(), pixels});
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);

  std::filesystem::create_directories(options.out);
  write_image(options.out / "color.png", bgr);
  write_image(options.out / "depth.png", depth);
  write_image(options.out / "depth_view.png", depth_for_people(depth));
  const std::filesystem::path truth = options.out / "truth.json";
  std::ofstream file{truth};
  file << describe(formation, snapshot, cell, model).dump(2) << "\n";
  if (!file.flush()) throw CameraError{"cannot write " + truth.string()};
  fmt::print("{}\n", truth.string());
}

}  // namespace
}  // namespace breakshot::sim_bridge

int main(int argc, char** argv) {
  breakshot::sim_bridge::Options options;
  CLI::App app{
      "Renders what the simulated camera sees of a formation: color.png, depth.png (0.1 mm), depth_view.png (for people), truth.json."};
  app.add_option("--config", options.config, "configuration of the cell")->capture_default_str();
  app.add_option("--set", options.overrides, "section.key=value: replaces a value of the configuration")->allow_extra_args(false);
  app.add_option("--formation", options.formation, "name in config/formations, or random:n=6,seed=3 (default: the configuration's)");
  app.add_option("--out", options.out, "folder for the files; made if need be")->capture_default_str();
  app.add_option("--joints", options.joints_deg, "joint angles of the arm in degrees, separated by commas (default: the park pose)")
      ->delimiter(',');
  app.add_option("--frame", options.frame, "number of the frame: another number, other noise")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    breakshot::sim_bridge::render(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "breakshot-render: {}\n", error.what());
    return 1;
  }
  return 0;
}
