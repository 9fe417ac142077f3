// breakshot-perceive: what perception sees in an image file.

#include "common/config/camera_file.hpp"
#include "perception/annotate.hpp"
#include "perception/image_file.hpp"
#include "perception/perceiver.hpp"
#include "perception/perception_config.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace breakshot::perception {
namespace {

struct Options {
  std::string method, image, depth, camera, config = "config/cell.yaml", json, annotated;
  std::vector<std::string> overrides;
};

nlohmann::json to_json(const Vector2& v) { return {v.x(), v.y()}; }

// Every pair nearer than `nearer_than`, with how sure the gap is.
nlohmann::json gaps_of(const Scene& scene, double nearer_than, double touch_gap) {
  nlohmann::json out = nlohmann::json::array();
  for (std::size_t a = 0; a < scene.discs.size(); ++a) {
    for (std::size_t b = a + 1; b < scene.discs.size(); ++b) {
      const SceneGap gap = gap_between(scene.discs[a], scene.discs[b]);
      if (gap.mean >= nearer_than) continue;
      out.push_back({{"between_ids", {scene.discs[a].id, scene.discs[b].id}},
                     {"gap_m", gap.mean},
                     {"sigma_m", gap.sigma},
                     {"p_touch", 0.5 * std::erfc((gap.mean - touch_gap) / (std::numbers::sqrt2 * gap.sigma))}});
    }
  }
  return out;
}

nlohmann::json to_json(const Scene& scene, const std::vector<ColourRange>& colours) {
  nlohmann::json out{{"quality", to_string(scene.quality)},
                     {"text", scene.text},
                     {"discs", nlohmann::json::array()},
                     {"contacts", nlohmann::json::array()}};
  for (const SceneDisc& disc : scene.discs) {
    out["discs"].push_back({{"id", disc.id},
                            {"colour", colours[disc.colour].name},
                            {"p_WD_m", to_json(disc.p_WD)},
                            {"covariance_m2", {to_json(disc.covariance.row(0)), to_json(disc.covariance.row(1))}},
                            {"radius_m", disc.radius},
                            {"radius_sigma_m", disc.radius_sigma},
                            {"complete", disc.complete}});
  }
  for (const SceneContact& contact : scene.contacts) {
    out["contacts"].push_back({{"between_ids", {scene.discs[contact.a].id, scene.discs[contact.b].id}},
                               {"gap_m", contact.gap},
                               {"p_touch", contact.p_touch},
                               {"push_start_W_m", to_json(contact.push_start_W)},
                               {"push_direction_W", to_json(contact.push_direction_W)},
                               {"contour_length_m", contact.contour_length}});
  }
  out["foreign"] = nlohmann::json::array();
  for (const ForeignObject& object : scene.foreign) {
    out["foreign"].push_back({{"what", to_string(object.kind)},
                              {"p_W_m", to_json(object.p_W)},
                              {"extent_m", object.extent},
                              {"height_m", object.height == 0.0 ? nlohmann::json() : nlohmann::json(object.height)}});
  }
  const double gap = smallest_gap(scene);
  out["smallest_gap_m"] = std::isfinite(gap) ? nlohmann::json(gap) : nlohmann::json();
  return out;
}

nlohmann::json to_json(const CameraCheck& check) {
  return {{"verdict", to_string(check.verdict)},
          {"markers_expected", check.expected},
          {"markers_seen", check.seen},
          {"shift_m", check.shift},
          {"moved_m", check.moved},
          {"turned_rad", check.turned}};
}

int run(const Options& options) {
  cv::setNumThreads(1);
  const ConfigDocument document = load_cell_document(options.config, options.overrides);
  const CellConfig cell = load_cell_config(document);
  PerceptionConfig config = load_perception_config(document, cell);
  if (!options.method.empty()) config.settings.method = options.method == "paper" ? Method::kPaper : Method::kRobust;
  const CameraModel camera = load_camera(options.camera.empty() ? cell.camera_file : std::filesystem::path{options.camera});

  ColorFrame color = read_color(options.image);
  DepthFrame depth;
  if (!options.depth.empty()) depth = read_depth(options.depth);
  Perceiver perceiver{config.settings, camera};
  const Scene scene = perceiver.process(color, options.depth.empty() ? nullptr : &depth);

  nlohmann::json found = to_json(scene, config.settings.colours);
  found["gaps"] = gaps_of(scene, 2.0 * cell.target_gap, config.settings.touch_gap);
  found["camera"] = to_json(perceiver.camera_check());
  const std::string text = found.dump(2);
  if (options.json.empty()) {
    std::cout << text << '\n';
  } else {
    std::ofstream file{options.json};
    file << text << '\n';
    if (!file.flush()) throw std::runtime_error(options.json + ": cannot be written");
  }
  if (scene.quality != SceneQuality::kOk) {
    std::cerr << "breakshot-perceive: " << options.image << ": " << to_string(scene.quality) << ": " << scene.text << '\n';
    return 1;
  }
  // Of one picture the watch makes no alarm yet; of a file there is no second one.
  if (const CameraCheck& check = perceiver.camera_check(); check.verdict == CameraCheck::Verdict::kMoved) {
    std::cerr << "breakshot-perceive: " << options.image << ": misplaced: " << describe(check, config.settings.watch.max_shift) << '\n';
    return 1;
  }
  if (!options.annotated.empty()) {
    Annotation annotation;
    annotation.workspace = cell.workspace;
    annotation.disc_height = cell.disc_height;
    annotation.striker_radius = cell.striker_radius;
    annotation.target_gap = cell.target_gap;
    write_color(options.annotated, annotate(color, scene, camera, annotation));
  }
  return 0;
}

}  // namespace
}  // namespace breakshot::perception

int main(int argc, char** argv) {
  breakshot::perception::Options options;
  CLI::App app{"Prints the scene that perception sees in an image file, as JSON in world coordinates"};
  app.add_option("--image", options.image, "PNG or JPEG from the camera")->required()->check(CLI::ExistingFile);
  app.add_option("--depth", options.depth, "16-bit PNG in 0.1 mm, registered to the image")->check(CLI::ExistingFile);
  app.add_option("--camera", options.camera, "calibration (default: the cell's)")->check(CLI::ExistingFile);
  app.add_option("--method", options.method, "robust or paper (default: the configuration's)")->check(CLI::IsMember({"robust", "paper"}));
  app.add_option("--config", options.config, "cell configuration")->capture_default_str()->check(CLI::ExistingFile);
  app.add_option("--set", options.overrides, "section.key=value: override the configuration");
  app.add_option("--json", options.json, "write the scene here instead of printing it");
  app.add_option("--annotated", options.annotated, "write the image with the scene drawn on it here");
  CLI11_PARSE(app, argc, argv);
  try {
    return breakshot::perception::run(options);
  } catch (const std::exception& error) {
    std::cerr << "breakshot-perceive: " << error.what() << '\n';
    return 1;
  }
}
