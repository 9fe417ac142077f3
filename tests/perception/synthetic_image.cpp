#include "tests/perception/synthetic_image.hpp"

#include "perception/hsv.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace breakshot::perception::test {
namespace {

constexpr double kDiscHeight = 0.020;  // m
constexpr int kSub = 6;                // sub-pixels per side where surfaces meet
constexpr double kGamma = 2.2;

using Rgb = Eigen::Vector3d;

// Linear reflectance of the eight colours; none so bright that twice the light turns its hue.
const std::array<Rgb, 8> kColours{Rgb{0.45, 0.02, 0.02}, Rgb{0.45, 0.16, 0.01}, Rgb{0.42, 0.36, 0.01}, Rgb{0.03, 0.32, 0.05},
                                  Rgb{0.01, 0.32, 0.36}, Rgb{0.02, 0.06, 0.45}, Rgb{0.17, 0.02, 0.40}, Rgb{0.45, 0.02, 0.25}};
const Rgb kTable{0.20, 0.20, 0.19};
const Rgb kArm{0.35, 0.36, 0.37};

// What a ray meets: 0 the table, 1 the arm, 2 + 2 i the top of disc i, 3 + 2 i its wall, -1 - i plate i.
struct Hit {
  int surface = 0;
  double azimuth = 0.0;  // of a wall's normal
  double height = 0.0;
};

// Discs that do not lie on the table: the top face and, as a plate below it, the lower one.
Hit trace_lifted(const SyntheticDisc& disc, int index, const CameraModel& camera, const Vector2& pixel) {
  const auto on = [&](double z) { return (camera.point_on_plane(pixel, z) - disc.p_WD).norm() <= disc.radius; };
  if (on(disc.lift + kDiscHeight)) return {2 + 2 * index, 0.0, disc.lift + kDiscHeight};
  if (on(disc.lift)) return {3 + 2 * index, 0.0, disc.lift};
  return {};
}

Hit trace(const SyntheticScene& scene, const CameraModel& camera, const Vector2& pixel) {
  if (scene.arm && scene.arm->contains(camera.point_on_plane(pixel, scene.arm_height))) return {1, 0.0, scene.arm_height};
  for (std::size_t i = 0; i < scene.plates.size(); ++i) {
    const SyntheticPlate& plate = scene.plates[i];
    if (plate.area.contains(camera.point_on_plane(pixel, plate.height))) return {-1 - static_cast<int>(i), 0.0, plate.height};
  }
  for (std::size_t i = 0; i < scene.discs.size(); ++i) {
    if (scene.discs[i].lift == 0.0) continue;
    if (const Hit hit = trace_lifted(scene.discs[i], static_cast<int>(i), camera, pixel); hit.surface != 0) return hit;
  }
  const Vector2 top = camera.point_on_plane(pixel, kDiscHeight);
  const Vector2 base = camera.point_on_plane(pixel, 0.0);
  const Vector2 way = base - top;
  Hit hit;
  double first = 2.0;
  for (std::size_t i = 0; i < scene.discs.size(); ++i) {
    if (scene.discs[i].lift > 0.0) continue;
    const Vector2 from = top - scene.discs[i].p_WD;
    const double r = scene.discs[i].radius;
    if (from.norm() <= r) return {2 + 2 * static_cast<int>(i), 0.0, kDiscHeight};
    const double a = way.squaredNorm();
    const double b = from.dot(way);
    const double discriminant = b * b - a * (from.squaredNorm() - r * r);
    if (a == 0.0 || discriminant < 0.0) continue;
    const double t = (-b - std::sqrt(discriminant)) / a;
    if (t < 0.0 || t > 1.0 || t >= first) continue;
    first = t;
    const Vector2 n = from + t * way;
    hit = {3 + 2 * static_cast<int>(i), std::atan2(n.y(), n.x()), kDiscHeight * (1.0 - t)};
  }
  return hit;
}

// Where rays have to be traced: generous boxes around everything that stands on the table.
cv::Mat1b near_something(const SyntheticScene& scene, const CameraModel& camera) {
  cv::Mat1b near(camera.height + 1, camera.width + 1, std::uint8_t{0});
  const auto add = [&](const Rect& area, double z) {
    std::vector<cv::Point2f> corners;
    for (const double height : {0.0, z}) {
      for (const Vector2& p : {area.min, area.max, Vector2{area.min.x(), area.max.y()}, Vector2{area.max.x(), area.min.y()}}) {
        const auto pixel = camera.project({p.x(), p.y(), height});
        corners.emplace_back(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
      }
    }
    const cv::Rect box = cv::boundingRect(corners) & cv::Rect{{0, 0}, near.size()};
    near(box) = 255;
  };
  for (const auto& disc : scene.discs) add(Rect{disc.p_WD, disc.p_WD}.grown(disc.radius + 0.004), disc.lift + kDiscHeight);
  for (const auto& plate : scene.plates) add(plate.area.grown(0.004), plate.height);
  if (scene.arm) add(scene.arm->grown(0.004), scene.arm_height);
  return near;
}

Rgb light(const SyntheticScene& scene, const Hit& hit) {
  if (hit.surface == 0) return scene.brightness * kTable;
  if (hit.surface < 0) return scene.brightness * scene.plates[static_cast<std::size_t>(-1 - hit.surface)].paint;
  if (hit.surface == 1) return scene.brightness * kArm;
  const Rgb& paint = kColours[scene.discs[static_cast<std::size_t>(hit.surface / 2 - 1)].colour];
  if (hit.surface % 2 == 0) return scene.brightness * paint;
  return scene.brightness * (0.55 + 0.25 * std::cos(hit.azimuth - scene.light_azimuth)) * paint;
}

double encoded_hue_deg(const Rgb& paint) {
  const Rgb encoded = 255.0 * paint.array().pow(1.0 / kGamma);
  return to_hsv(encoded.x(), encoded.y(), encoded.z()).hue_deg;
}

}  // namespace

CameraModel test_camera(bool bent) {
  CameraModel camera;
  camera.fx = 915.0;
  camera.fy = 914.0;
  camera.cx = 638.4;
  camera.cy = 356.7;
  Matrix3 down;
  down << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  if (bent) {
    camera.distortion = {0.08, -0.15, 0.0004, -0.0003, 0.05};
    down = Eigen::AngleAxisd(0.035, Vector3{0.6, 0.8, 0.0}).toRotationMatrix() * down;
  }
  camera.X_WC.linear() = down;
  camera.X_WC.translation() = bent ? Vector3{0.01, -0.015, 0.81} : Vector3{0.0, 0.0, 0.8};
  return camera;
}

PerceptionSettings test_settings() {
  PerceptionSettings settings;
  settings.disc_height = kDiscHeight;
  settings.colours = {{"red", 345, 12},   {"orange", 15, 38}, {"yellow", 45, 70},   {"green", 100, 150},
                      {"cyan", 165, 200}, {"blue", 210, 245}, {"violet", 255, 290}, {"magenta", 305, 340}};
  for (std::size_t i = 0; i < settings.colours.size(); ++i) settings.colours[i].paint_hue_deg = encoded_hue_deg(kColours[i]);
  settings.edge_gamma = kGamma;
  for (std::size_t c = 0; c < 3; ++c) settings.table_rgb[c] = 255.0 * std::pow(kTable[static_cast<Eigen::Index>(c)], 1.0 / kGamma);
  return settings;
}

SyntheticFrames render(const SyntheticScene& scene, const CameraModel& camera, std::uint64_t seq) {
  cv::Mat3f image(camera.height, camera.width);
  SyntheticFrames frames;
  frames.depth.depth.resize(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  std::vector<Hit> above(static_cast<std::size_t>(camera.width) + 1);
  std::vector<Hit> below(static_cast<std::size_t>(camera.width) + 1);
  const cv::Mat1b near = near_something(scene, camera);
  const auto trace_row = [&](int y, std::vector<Hit>& row) {
    for (int x = 0; x <= camera.width; ++x) {
      row[static_cast<std::size_t>(x)] = near(y, x) != 0 ? trace(scene, camera, {x - 0.5, y - 0.5}) : Hit{};
    }
  };
  trace_row(0, below);
  for (int y = 0; y < camera.height; ++y) {
    std::swap(above, below);
    trace_row(y + 1, below);
    for (int x = 0; x < camera.width; ++x) {
      const auto i = static_cast<std::size_t>(x);
      const int s = above[i].surface;
      Rgb sum = Rgb::Zero();
      if (s == above[i + 1].surface && s == below[i].surface && s == below[i + 1].surface) {
        sum = (light(scene, above[i]) + light(scene, below[i + 1])) / 2.0;
      } else {
        for (int k = 0; k < kSub * kSub; ++k) {
          const Vector2 at{x - 0.5 + (k % kSub + 0.5) / kSub, y - 0.5 + (k / kSub + 0.5) / kSub};
          sum += light(scene, trace(scene, camera, at)) / (kSub * kSub);
        }
      }
      image(y, x) = {static_cast<float>(sum.x()), static_cast<float>(sum.y()), static_cast<float>(sum.z())};
      const double range = (camera.X_WC.translation().z() - above[i].height);
      frames.depth.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) + i] =
          static_cast<std::uint16_t>(1e4 * range);
    }
  }
  if (scene.blur > 0.0) cv::GaussianBlur(image, image, {0, 0}, scene.blur);
  cv::pow(cv::min(image, 1.0F), 1.0 / kGamma, image);
  image *= 255.0;
  if (scene.noise > 0.0) {
    cv::RNG random{seq};
    cv::Mat3f noise(image.size());
    random.fill(noise, cv::RNG::NORMAL, 0.0, scene.noise);
    image += noise;
  }
  cv::Mat3b bytes;
  image.convertTo(bytes, CV_8U);
  frames.color.seq = frames.depth.seq = seq;
  frames.color.exposed = frames.depth.exposed = time_from_ns(static_cast<std::int64_t>(seq) * 33'333'333);
  frames.color.width = frames.depth.width = camera.width;
  frames.color.height = frames.depth.height = camera.height;
  frames.color.rgb.assign(bytes.datastart, bytes.dataend);
  return frames;
}

std::vector<SyntheticDisc> random_discs(std::uint32_t seed, int n, const Rect& area, double min_gap, double radius_min, double radius_max) {
  std::mt19937 random{seed};
  const auto uniform = [&](double low, double high) { return low + (high - low) * (static_cast<double>(random()) / 4294967296.0); };
  std::vector<SyntheticDisc> discs;
  while (static_cast<int>(discs.size()) < n) {
    const SyntheticDisc disc{{uniform(area.min.x(), area.max.x()), uniform(area.min.y(), area.max.y())},
                             uniform(radius_min, radius_max),
                             static_cast<std::uint8_t>(discs.size() % kColours.size()),
                             0.0};
    const bool free = std::all_of(discs.begin(), discs.end(), [&](const SyntheticDisc& other) {
      return (disc.p_WD - other.p_WD).norm() >= disc.radius + other.radius + min_gap;
    });
    if (free) discs.push_back(disc);
  }
  return discs;
}

std::vector<SyntheticDisc> touching_discs(std::uint32_t seed, int n, const Rect& area, double radius_min, double radius_max, int colours) {
  std::mt19937 random{seed};
  const auto uniform = [&](double low, double high) { return low + (high - low) * (static_cast<double>(random()) / 4294967296.0); };
  std::vector<SyntheticDisc> discs{{0.5 * (area.min + area.max), uniform(radius_min, radius_max), 0, 0.0}};
  while (static_cast<int>(discs.size()) < n) {
    const SyntheticDisc& host = discs[random() % discs.size()];
    const double radius = uniform(radius_min, radius_max), bearing = uniform(0.0, 2.0 * CV_PI);
    const SyntheticDisc disc{host.p_WD + (host.radius + radius) * Vector2{std::cos(bearing), std::sin(bearing)}, radius,
                             static_cast<std::uint8_t>(discs.size() % static_cast<std::size_t>(colours)), 0.0};
    if (!area.contains(disc.p_WD)) continue;
    const bool free = std::all_of(discs.begin(), discs.end(), [&](const SyntheticDisc& other) {
      return &other == &host || (disc.p_WD - other.p_WD).norm() >= disc.radius + other.radius;
    });
    if (free) discs.push_back(disc);
  }
  return discs;
}

}  // namespace breakshot::perception::test
