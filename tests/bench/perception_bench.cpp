// `./breakshot bench perception`: how well perception measures, on pictures of the simulator's camera.
//
// Three kinds of scene take turns: six discs spread over the workspace, a random cluster with gaps up to half a millimetre, and three pairs
// with gaps of 0 to 8 mm. Truth is used here to score, never by perception.

#include "common/config/camera_file.hpp"
#include "common/config/formation.hpp"
#include "perception/perceiver.hpp"
#include "perception/perception_config.hpp"
#include "tests/bench/report.hpp"
#include "tests/support/render_scene.hpp"

#include <CLI/CLI.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <numbers>
#include <random>
#include <vector>

namespace breakshot::perception {
namespace {

using sim_bridge::DiscState;

constexpr double kTouch = 0.5e-3;  // m: pairs nearer than this count as touching

struct Options {
  int n = 120;
  std::uint32_t seed = 1;
  double brightness = 1.0;
  std::string config = "config/cell.yaml";
  std::string json;
  bool verbose = false;
};

class SceneMaker {
 public:
  SceneMaker(const CellConfig& cell, std::uint32_t seed) : cell_{cell}, random_{seed} {}

  std::vector<DiscState> make(int kind) {
    switch (kind) {
      case 0: return spread();
      case 1: return cluster();
      default: return pairs();
    }
  }

 private:
  double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0); }
  std::uint8_t colour(std::size_t i) const { return static_cast<std::uint8_t>(i % cell_.colours.size()); }
  static bool free(const std::vector<DiscState>& discs, const DiscState& disc, double margin) {
    return std::all_of(discs.begin(), discs.end(),
                       [&](const DiscState& d) { return (d.p_WD - disc.p_WD).norm() > d.radius + disc.radius + margin; });
  }

  std::vector<DiscState> spread() {
    std::vector<DiscState> discs;
    while (discs.size() < 6) {
      const auto disc = support::disc_at(uniform(-0.3, 0.3), uniform(-0.3, 0.3), colour(discs.size() + random_() % 8));
      if (free(discs, disc, 0.0)) discs.push_back(disc);
    }
    return discs;
  }

  std::vector<DiscState> cluster() {
    RandomCluster wanted;
    wanted.seed = random_();
    Formation formation = random_cluster(wanted, cell_);
    SplitMix64 jitter_random{random_()};
    jitter(formation, jitter_random, 0.5e-3);
    const double turn = uniform(0.0, 2.0 * std::numbers::pi);
    const Vector2 shift{uniform(-0.15, 0.15), uniform(-0.12, 0.12)};
    std::vector<DiscState> discs;
    for (const auto& d : formation.discs) {
      const Vector2 p = Eigen::Rotation2Dd{turn} * d.p_WD + shift;
      discs.push_back(support::disc_at(p.x(), p.y(), d.colour, d.radius));
    }
    return discs;
  }

  std::vector<DiscState> pairs() {
    std::vector<DiscState> discs;
    while (discs.size() < 6) {
      const double gap = uniform(0.0, 0.008);
      const double bearing = uniform(0.0, 2.0 * std::numbers::pi);
      const Vector2 half = (0.030 + gap / 2.0) * Vector2{std::cos(bearing), std::sin(bearing)};
      const Vector2 middle{uniform(-0.27, 0.27), uniform(-0.24, 0.24)};
      const auto a = support::disc_at(middle.x() - half.x(), middle.y() - half.y(), colour(discs.size()));
      const auto b = support::disc_at(middle.x() + half.x(), middle.y() + half.y(), colour(discs.size() + 1));
      if (!free(discs, a, 0.010) || !free(discs, b, 0.010)) continue;
      discs.push_back(a);
      discs.push_back(b);
    }
    return discs;
  }

  const CellConfig& cell_;
  std::mt19937 random_;
};

struct Decision {
  int pairs = 0, contours = 0, fits = 0;  // pairs of that gap; called a contact by the paper's method; called touching by the fitted gap
};

struct Score {
  int discs = 0, missed = 0, invented = 0;
  double centre2 = 0.0, centre_max = 0.0, radius2 = 0.0, radius_max = 0.0, radius_sum = 0.0, outward_sum = 0.0, nees = 0.0,
         radius_nees = 0.0;
  double gap2 = 0.0, gap_max = 0.0, gap_nees = 0.0, axis2 = 0.0, axis_max = 0.0;
  int gaps = 0, axes = 0;
  std::map<int, Decision> by_gap;            // key: gap in 0.5 mm
  std::array<double, 4> centre2_by_range{};  // by distance from W's origin, 0.1 m each
  std::array<int, 4> discs_by_range{};
  std::vector<double> frame_ms;
};

void add(Score& score, const Scene& scene, const std::vector<DiscState>& truth, bool verbose) {
  std::vector<int> of(truth.size(), -1);
  for (std::size_t i = 0; i < scene.discs.size(); ++i) {
    const auto& disc = scene.discs[i];
    const auto nearest = std::min_element(truth.begin(), truth.end(), [&](const DiscState& a, const DiscState& b) {
      return (a.p_WD - disc.p_WD).norm() < (b.p_WD - disc.p_WD).norm();
    });
    const Vector2 error = disc.p_WD - nearest->p_WD;
    if (error.norm() > 0.010 || nearest->colour != disc.colour) {
      ++score.invented;
      if (verbose) std::printf("  invented: colour %d at %.4f %.4f\n", disc.colour, disc.p_WD.x(), disc.p_WD.y());
      continue;
    }
    of[static_cast<std::size_t>(nearest - truth.begin())] = static_cast<int>(i);
    const double radius_error = disc.radius - nearest->radius;
    ++score.discs;
    score.centre2 += error.squaredNorm();
    score.centre_max = std::max(score.centre_max, error.norm());
    score.outward_sum += error.dot(nearest->p_WD.normalized());
    score.radius2 += radius_error * radius_error;
    score.radius_sum += radius_error;
    score.radius_max = std::max(score.radius_max, std::abs(radius_error));
    score.nees += error.dot(disc.covariance.inverse() * error);
    score.radius_nees += std::pow(radius_error / disc.radius_sigma, 2);
    const auto ring = static_cast<std::size_t>(std::min(3.0, 10.0 * nearest->p_WD.norm()));
    score.centre2_by_range[ring] += error.squaredNorm();
    ++score.discs_by_range[ring];
    if (verbose && (error.norm() > 0.3e-3 || std::abs(radius_error) > 0.3e-3)) {
      std::printf("  poor: colour %d at %.4f %.4f: centre off by %.3f %.3f mm, radius by %.3f mm, %s\n", disc.colour, nearest->p_WD.x(),
                  nearest->p_WD.y(), 1e3 * error.x(), 1e3 * error.y(), 1e3 * radius_error, disc.complete ? "complete" : "partial");
    }
  }
  for (std::size_t t = 0; t < truth.size(); ++t) {
    if (of[t] >= 0) continue;
    ++score.missed;
    if (verbose) std::printf("  missed: colour %d at %.4f %.4f\n", truth[t].colour, truth[t].p_WD.x(), truth[t].p_WD.y());
  }
  for (std::size_t a = 0; a < truth.size(); ++a) {
    for (std::size_t b = a + 1; b < truth.size(); ++b) {
      const double gap = (truth[a].p_WD - truth[b].p_WD).norm() - truth[a].radius - truth[b].radius;
      if (gap > 0.010 || of[a] < 0 || of[b] < 0) continue;
      const auto& disc_a = scene.discs[static_cast<std::size_t>(of[a])];
      const auto& disc_b = scene.discs[static_cast<std::size_t>(of[b])];
      const double seen = (disc_a.p_WD - disc_b.p_WD).norm() - disc_a.radius - disc_b.radius;
      ++score.gaps;
      score.gap2 += (seen - gap) * (seen - gap);
      score.gap_max = std::max(score.gap_max, std::abs(seen - gap));
      const Vector2 n_AB = (disc_b.p_WD - disc_a.p_WD).normalized();
      score.gap_nees += std::pow(seen - gap, 2) / (n_AB.dot((disc_a.covariance + disc_b.covariance) * n_AB) +
                                                   std::pow(disc_a.radius_sigma, 2) + std::pow(disc_b.radius_sigma, 2));
      Decision& decision = score.by_gap[static_cast<int>(gap / 0.5e-3)];
      ++decision.pairs;
      decision.fits += seen < kTouch ? 1 : 0;
      const auto low = static_cast<std::uint16_t>(std::min(of[a], of[b]));
      const auto high = static_cast<std::uint16_t>(std::max(of[a], of[b]));
      for (const auto& contact : scene.contacts) {
        if (contact.a != low || contact.b != high) continue;
        ++decision.contours;
        const Vector2 n = (truth[b].p_WD - truth[a].p_WD).normalized();
        const double degrees = std::asin(std::min(1.0, std::abs(contact.push_direction_W.dot(n)))) * 180.0 / std::numbers::pi;
        ++score.axes;
        score.axis2 += degrees * degrees;
        score.axis_max = std::max(score.axis_max, degrees);
        if (gap < kTouch && verbose && degrees > 6.0) {
          std::printf("  axis: %.1f deg off between %.3f %.3f and %.3f %.3f, gap %.2f mm\n", degrees, truth[a].p_WD.x(), truth[a].p_WD.y(),
                      truth[b].p_WD.x(), truth[b].p_WD.y(), 1e3 * gap);
        }
      }
    }
  }
}

// CPU time of this thread, ms: does not depend on what else the machine does.
double cpu_ms_of(const auto& work) {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

// What any method must do at least: bring the colours into HSV, and look at every pixel once.
double lower_bound_ms(const ColorFrame& frame) {
  cv::Mat rgb(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.rgb.data()));
  cv::Mat hsv, mask;
  std::vector<double> ms;
  for (int i = 0; i < 15; ++i) {
    ms.push_back(cpu_ms_of([&] {
      cv::cvtColor(rgb, hsv, cv::COLOR_RGB2HSV);
      cv::inRange(hsv, cv::Scalar(0, 100, 40), cv::Scalar(180, 255, 255), mask);
    }));
  }
  std::nth_element(ms.begin(), ms.begin() + 7, ms.end());
  return ms[7];
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Of the decision "touching" for pairs below kTouch: 2 tp / (2 tp + fp + fn).
double f1(const Score& score, int Decision::*positive) {
  int tp = 0, fp = 0, fn = 0;
  for (const auto& [key, decision] : score.by_gap) {
    if (key == 0) {
      tp += decision.*positive;
      fn += decision.pairs - decision.*positive;
    } else {
      fp += decision.*positive;
    }
  }
  return 2.0 * tp / std::max(1, 2 * tp + fp + fn);
}

void report(const Score& score, double bound_ms, const Options& options) {
  const double n = score.discs;
  const auto rms_mm = [](double sum2, double count) { return 1e3 * std::sqrt(sum2 / std::max(1.0, count)); };
  const double centre_rms = rms_mm(score.centre2, n);
  const double radius_rms = rms_mm(score.radius2, n);
  const double frame_ms = median(score.frame_ms);
  std::printf("scenes %d, brightness %.2f: discs %d, missed %d, invented %d\n", options.n, options.brightness, score.discs, score.missed,
              score.invented);
  std::printf("centre   rms %.3f mm, max %.3f mm, bias outwards %+.3f mm; NEES %.2f (2 is right)\n", centre_rms, 1e3 * score.centre_max,
              1e3 * score.outward_sum / n, score.nees / n);
  for (std::size_t i = 0; i < 4; ++i) {
    std::printf("         rms %.3f mm from %zu00 to %zu00 mm off the middle (%d discs)\n",
                rms_mm(score.centre2_by_range[i], score.discs_by_range[i]), i, i + 1, score.discs_by_range[i]);
  }
  std::printf("radius   rms %.3f mm, max %.3f mm, bias %+.3f mm; NEES %.2f (1 is right)\n", radius_rms, 1e3 * score.radius_max,
              1e3 * score.radius_sum / n, score.radius_nees / n);
  std::printf("gap      rms %.3f mm, max %.3f mm over %d pairs nearer than 10 mm; NEES %.2f (1 is right)\n", rms_mm(score.gap2, score.gaps),
              1e3 * score.gap_max, score.gaps, score.gap_nees / std::max(1, score.gaps));
  std::printf("push     axis rms %.2f deg, max %.2f deg off the common tangent over %d contacts\n",
              std::sqrt(score.axis2 / std::max(1, score.axes)), score.axis_max, score.axes);
  std::printf("gap, mm      pairs   contact by contours   touching by fits\n");
  for (const auto& [key, decision] : score.by_gap) {
    std::printf("%3.1f to %4.1f  %6d  %20d  %17d\n", 0.5 * key, 0.5 * (key + 1), decision.pairs, decision.contours, decision.fits);
  }
  std::printf("touch F1 contours %.3f, fits %.3f\n", f1(score, &Decision::contours), f1(score, &Decision::fits));
  std::printf("frame    median %.2f ms of CPU; colour conversion and one pass %.2f ms\n", frame_ms, bound_ms);
  if (options.json.empty()) return;

  int false_contours = 0, false_fits = 0;
  for (const auto& [key, decision] : score.by_gap) {
    if (key == 0) continue;
    false_contours += decision.contours;
    false_fits += decision.fits;
  }
  const nlohmann::json metrics{{"robust.centre_rms_mm", centre_rms},
                               {"robust.centre_max_mm", 1e3 * score.centre_max},
                               {"robust.radius_rms_mm", radius_rms},
                               {"robust.touch_f1", f1(score, &Decision::fits)},
                               {"robust.false_contacts", false_fits},
                               {"robust.nees", score.nees / n},
                               {"robust.gap_rms_mm", rms_mm(score.gap2, score.gaps)},
                               {"paper.touch_f1", f1(score, &Decision::contours)},
                               {"paper.false_contacts", false_contours},
                               {"paper.axis_rms_deg", std::sqrt(score.axis2 / std::max(1, score.axes))},
                               {"missed", score.missed},
                               {"invented", score.invented},
                               {"frame_ms_median", frame_ms},
                               {"over_lower_bound", frame_ms / bound_ms}};
  nlohmann::json goals;
  const auto goal = [&](const char* name, double value, double at_most) {
    goals[name] = {{"value", value}, {"goal", at_most}, {"met", value <= at_most}};
  };
  goal("robust.centre_rms_mm", centre_rms, 0.3);
  goal("robust.centre_max_mm", 1e3 * score.centre_max, 1.0);
  goal("robust.radius_rms_mm", radius_rms, 0.3);
  goal("frame_ms_median", frame_ms, 10.0);
  const nlohmann::json args{{"n", options.n}, {"seed", options.seed}, {"brightness", options.brightness}};
  bench::write_file(options.json, bench::report("perception", args, metrics, goals).dump(2) + "\n");
}

void run(const Options& options) {
  cv::setNumThreads(1);
  const ConfigDocument document = load_cell_document(options.config);
  const CellConfig cell = load_cell_config(document);
  const PerceptionConfig config = load_perception_config(document, cell);
  const CameraModel camera = load_camera(cell.camera_file);

  sim_bridge::CameraSettings camera_settings;
  camera_settings.palette.clear();
  for (const Colour& colour : cell.colours) {
    sim_bridge::Rgb rgb{};
    std::transform(colour.rgb.begin(), colour.rgb.end(), rgb.begin(), [](std::uint8_t c) { return static_cast<float>(c) / 255.0F; });
    camera_settings.palette.push_back(rgb);
  }
  camera_settings.exposure.brightness = options.brightness;
  support::SceneRenderer renderer{camera_settings, camera};
  Perceiver perceiver{config.settings, camera};
  SceneMaker maker{cell, options.seed};
  Score score;
  double bound_ms = 0.0;
  for (int i = 0; i < options.n; ++i) {
    auto picture = renderer.take(maker.make(i % 3), static_cast<std::uint64_t>(i));
    picture.color.seq = picture.depth.seq = static_cast<std::uint64_t>(i);
    picture.color.exposed = time_from_ns(33'333'333LL * i);
    Scene scene;
    score.frame_ms.push_back(cpu_ms_of([&] { scene = perceiver.process(picture.color, &picture.depth); }));
    if (options.verbose) std::printf("scene %d\n", i);
    if (scene.quality != SceneQuality::kOk) std::printf("scene %d: %s\n", i, scene.text.c_str());
    add(score, scene, picture.truth, options.verbose);
    if (i == 0) bound_ms = lower_bound_ms(picture.color);
  }
  report(score, bound_ms, options);
}

}  // namespace
}  // namespace breakshot::perception

int main(int argc, char** argv) {
  breakshot::perception::Options options;
  CLI::App app{"Measures perception on pictures of the simulator's camera"};
  app.add_option("--n", options.n, "scenes")->check(CLI::Range(1, 1'000'000));
  app.add_option("--seed", options.seed, "of the scenes");
  app.add_option("--brightness", options.brightness, "factor on the light")->check(CLI::Range(0.05, 8.0));
  app.add_option("--config", options.config, "cell configuration")->check(CLI::ExistingFile);
  app.add_option("--json", options.json, "file for the figures");
  app.add_flag("--verbose", options.verbose, "name every poor fit");
  CLI11_PARSE(app, argc, argv);
  try {
    breakshot::perception::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "breakshot-bench-perception: %s\n", error.what());
    return 1;
  }
  return 0;
}
