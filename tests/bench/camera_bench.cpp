// `./breakshot bench camera`: what a frame pair of the simulated camera costs, with the cell's arm parked and over the table.

#include "common/config/camera_file.hpp"
#include "common/random.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "sim_bridge/camera/lighting.hpp"
#include "sim_bridge/sim_bridge_config.hpp"
#include "tests/bench/report.hpp"
#include "tests/support/render_scene.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <numbers>
#include <string>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

struct Options {
  int n = 100;
  std::uint64_t seed = 1;
  std::string config = "config/cell.yaml";
  std::string lighting;  ///< preset; empty: as configured
  std::string json;
};

// CPU time of this thread, ms: does not depend on what else the machine does, save for its caches. The camera renders on the caller's thread.
double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

struct Times {
  std::vector<double> ms;
  double at(double share) const { return ms[static_cast<std::size_t>(share * static_cast<double>(ms.size() - 1))]; }
};

Times measure(Camera& camera, WorldSnapshot snapshot, const std::vector<std::vector<Pose>>& postures) {
  const auto pixels = static_cast<std::size_t>(camera.model().width) * static_cast<std::size_t>(camera.model().height);
  std::vector<std::uint8_t> rgb(3 * pixels);
  std::vector<std::uint16_t> depth(pixels);
  Times times;
  std::uint64_t frame = 0;
  for (const auto& X_WL : postures) {
    snapshot.X_WL = X_WL;
    const double start = cpu_ms();
    camera.render(snapshot, ++frame, rgb, depth);
    times.ms.push_back(cpu_ms() - start);
  }
  std::sort(times.ms.begin(), times.ms.end());
  return times;
}

void run(const Options& options) {
  const ConfigDocument document = load_cell_document(options.config);
  const CellConfig cell = load_cell_config(document);
  const ArmDescription arm = load_cell_arm(cell);
  const kinematics::ArmKinematics kinematics{arm, cell.arm.X_WB};
  const kinematics::InverseKinematics inverse{kinematics};
  const auto links = [&](const JointVector& q) {
    std::vector<Pose> X_WL(arm.links.size());
    (void)kinematics.links_in_world(q, X_WL);
    return X_WL;
  };
  SimBridgeConfig config = load_sim_bridge_config(document, cell);
  if (!options.lighting.empty()) apply_lighting(config.lighting_folder, options.lighting, config.camera);
  Camera camera{load_camera(cell.camera_file), config.camera, arm, cell.arm.X_WB};
  WorldSnapshot snapshot;
  snapshot.discs = support::rack_of_six({0.0, 0.0});

  // The arm as in strokes: its tip low over the workspace, anywhere that it can reach.
  SplitMix64 random{options.seed};
  const auto uniform = [&](double low, double high) { return random.uniform(low, high); };
  std::vector<std::vector<Pose>> working;
  while (static_cast<int>(working.size()) < options.n) {
    Pose X_WT{Pose::Identity()};
    X_WT.translation() << uniform(-0.3, 0.3), uniform(-0.3, 0.3), uniform(0.008, 0.10);
    X_WT.linear() = (Eigen::AngleAxisd{uniform(-3.0, 3.0), Vector3::UnitZ()} * Eigen::AngleAxisd{std::numbers::pi, Vector3::UnitX()})
                        .toRotationMatrix();
    const auto solutions = inverse.solve(X_WT, cell.arm.park);
    if (!solutions.empty()) working.push_back(links(*solutions.begin()));
  }
  const std::vector<std::vector<Pose>> parked(static_cast<std::size_t>(options.n), links(cell.arm.park));
  (void)measure(camera, snapshot, {working.begin(), working.begin() + std::min<std::ptrdiff_t>(10, options.n)});  // warms up
  const Times rest = measure(camera, snapshot, parked);
  const Times work = measure(camera, snapshot, working);

  std::printf("CPU time per frame pair, six discs, ms   median   p95     max\n");
  std::printf("arm parked                              %7.2f %7.2f %7.2f\n", rest.at(0.5), rest.at(0.95), rest.ms.back());
  std::printf("arm over the table                      %7.2f %7.2f %7.2f\n", work.at(0.5), work.at(0.95), work.ms.back());
  if (options.json.empty()) return;
  const nlohmann::json metrics{{"parked_ms_median", rest.at(0.5)},
                               {"parked_ms_p95", rest.at(0.95)},
                               {"working_ms_median", work.at(0.5)},
                               {"working_ms_p95", work.at(0.95)},
                               {"working_ms_max", work.ms.back()}};
  const nlohmann::json goals{{"working_ms_median", {{"value", work.at(0.5)}, {"goal", 15.0}, {"met", work.at(0.5) <= 15.0}}}};
  const nlohmann::json args{{"n", options.n}, {"seed", options.seed}, {"lighting", options.lighting}};
  bench::write_file(options.json, bench::report("camera", args, metrics, goals).dump(2) + "\n");
}

}  // namespace
}  // namespace breakshot::sim_bridge

int main(int argc, char** argv) {
  breakshot::sim_bridge::Options options;
  CLI::App app{"Measures what a frame pair of the simulated camera costs"};
  app.add_option("--n", options.n, "frames of each kind")->check(CLI::Range(1, 100'000))->capture_default_str();
  app.add_option("--seed", options.seed, "of the arm's poses")->capture_default_str();
  app.add_option("--config", options.config, "cell configuration")->check(CLI::ExistingFile)->capture_default_str();
  app.add_option("--lighting", options.lighting, "preset in config/lighting (default: as configured)");
  app.add_option("--json", options.json, "file for the figures");
  CLI11_PARSE(app, argc, argv);
  try {
    breakshot::sim_bridge::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "breakshot-bench-camera: %s\n", error.what());
    return 1;
  }
  return 0;
}
