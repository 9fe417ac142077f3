#include "perception/disc_fit.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace breakshot::perception {
namespace {

constexpr int kDirections = 144;  // one per 1.5 px of a 30 mm disc's outline: closer ones would share their pixels' noise
constexpr int kPasses = 3;
constexpr int kSamples = 15;                                   // of a profile across the rim
constexpr double kSampleStep = 0.5;                            // px
constexpr double kReach = kSampleStep * (kSamples - 1) / 2.0;  // px to either side
constexpr double kRimBlur = 1.5;                               // px: from there on an edge's blur has faded
constexpr int kSideSamples = 3;        // that tell the colour of each side: they lie 2.5 px and more from the rim, beyond its blur
constexpr double kMinContrast = 15.0;  // distance of the two sides in RGB, [0, 255]: five times the noise of a sample
constexpr double kTukey = 4.685;       // 95 % efficiency for normal errors (Holland and Welsch 1977)
constexpr double kBiasPatches = 8.0;   // directions that share one draw of edge_bias_sigma: an eighth of the outline

using Colour = Eigen::Vector3f;

// The light at a place between pixels.
Colour sample(const cv::Mat3b& rgb, const std::array<float, 256>& light, const Vector2& at) noexcept {
  const int x = static_cast<int>(at.x());
  const int y = static_cast<int>(at.y());
  const auto fx = static_cast<float>(at.x() - x);
  const auto fy = static_cast<float>(at.y() - y);
  const std::uint8_t* top = rgb.ptr<std::uint8_t>(y) + 3 * x;
  const std::uint8_t* bottom = rgb.ptr<std::uint8_t>(y + 1) + 3 * x;
  const auto pixel = [&](const std::uint8_t* p) { return Colour{light[p[0]], light[p[1]], light[p[2]]}; };
  return (1 - fy) * ((1 - fx) * pixel(top) + fx * pixel(top + 3)) + fy * ((1 - fx) * pixel(bottom) + fx * pixel(bottom + 3));
}

// Distance of point c from the segment ab.
double distance_to_segment(const Vector2& c, const Vector2& a, const Vector2& b) noexcept {
  const Vector2 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((c - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (a + t * ab - c).norm();
}

// Where a profile of colours passes half-way from its inside to its outside, in samples from its middle; nothing when it does not.
std::optional<double> half_way(const std::array<Colour, kSamples>& profile, const Colour& inside, const Colour& outside) noexcept {
  const Colour contrast = inside - outside;
  const float scale = 1.0F / contrast.squaredNorm();
  const auto share = [&](const Colour& c) { return (c - outside).dot(contrast) * scale; };
  constexpr double kMiddle = (kSamples - 1) / 2.0;
  std::optional<double> nearest;
  float previous = share(profile[0]);
  for (std::size_t i = 1; i < kSamples; ++i) {
    const float next = share(profile[i]);
    if (previous >= 0.5F && next < 0.5F) {
      const double at = static_cast<double>(i - 1) + static_cast<double>((previous - 0.5F) / (previous - next)) - kMiddle;
      if (!nearest || std::abs(at) < std::abs(*nearest)) nearest = at;
    }
    previous = next;
  }
  return nearest;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

DiscFitter::DiscFitter(const View& view, const PerceptionSettings& settings, const Segmenter& segmenter)
    : view_{view}, settings_{settings}, segmenter_{segmenter} {
  for (std::size_t i = 0; i < light_.size(); ++i) {
    light_[i] = static_cast<float>(255.0 * std::pow(static_cast<double>(i) / 255.0, settings.edge_gamma));
  }
}

bool DiscFitter::occluded(const DepthFrame& depth, const Vector2& pixel) const noexcept {
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  if (x < 0 || y < 0 || x >= depth.width || y >= depth.height) return false;
  const double range =
      1e-4 * depth.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(depth.width) + static_cast<std::size_t>(x)];
  if (range == 0.0) return false;  // a hole says nothing
  const CameraModel& camera = view_.camera;
  const Vector3 p_C{range * (x - camera.cx) / camera.fx, range * (y - camera.cy) / camera.fy, range};
  return (camera.X_WC * p_C).z() > settings_.occluder_height;
}

DiscFitter::Look DiscFitter::look(const cv::Mat3b& rgb, const DepthFrame* depth, const CircleGuess& disc, std::span<const CircleGuess> near,
                                  const Vector2& n_W, double& range) const {
  const bool top = view_.top_rim_bounds(disc.p_WD, disc.radius, n_W);
  const double z = view_.rim_height(top);
  const Vector2 rim = disc.p_WD + disc.radius * n_W;
  constexpr double kProbe = 1e-3;  // m
  const Vector2 beyond = rim + kProbe * n_W;
  const auto pixel = view_.camera.project({rim.x(), rim.y(), z});
  const auto pixel_beyond = view_.camera.project({beyond.x(), beyond.y(), z});
  if (!pixel || !pixel_beyond) return Look::kHidden;
  const Vector2 across = *pixel_beyond - *pixel;
  const double pixels_per_metre = across.norm() / kProbe;
  const Vector2 step = across.normalized() * kSampleStep;

  // What the far end of the profile looks onto, along its ray from the plane of the top faces down to the table.
  const Vector2 far_end = rim + kReach / pixels_per_metre * n_W;
  const Vector2 ray_top = top ? far_end : view_.top_of_ray(far_end);
  const Vector2 ray_base = top ? view_.base_of_ray(far_end) : far_end;
  for (const auto& other : near) {
    if (distance_to_segment(other.p_WD, ray_top, ray_base) < other.radius) return Look::kNeighbour;
  }

  // Past a narrow wall the profile's inner end would lie on the top face, and the half-way colour nowhere in particular.
  if (!top && view_.wall_width(disc.p_WD, disc.radius, n_W) * pixels_per_metre < kReach + kRimBlur) return Look::kNarrowWall;

  const Vector2 first = *pixel - step * ((kSamples - 1) / 2.0);
  const Vector2 last = *pixel + step * ((kSamples - 1) / 2.0);
  const auto within = [&](const Vector2& p) { return p.x() >= 0.0 && p.y() >= 0.0 && p.x() < rgb.cols - 1 && p.y() < rgb.rows - 1; };
  if (!within(first) || !within(last)) return Look::kHidden;
  if (depth != nullptr && (occluded(*depth, first) || occluded(*depth, last) || occluded(*depth, last + 8.0 * step))) return Look::kHidden;

  std::array<Colour, kSamples> profile;
  for (std::size_t i = 0; i < kSamples; ++i) profile[i] = sample(rgb, light_, first + static_cast<double>(i) * step);
  Colour inside = Colour::Zero();
  Colour outside = Colour::Zero();
  for (std::size_t i = 0; i < kSideSamples; ++i) {
    inside += profile[i] / static_cast<float>(kSideSamples);
    outside += profile[kSamples - 1 - i] / static_cast<float>(kSideSamples);
  }
  if ((inside - outside).norm() < static_cast<float>(kMinContrast)) return Look::kHidden;
  // The arm, or a highlight: asked of the pixel itself, as the colour table speaks of encoded values.
  const Vector2 within_rim = *pixel - 3.0 / kSampleStep * step;
  const std::uint8_t* p = rgb.ptr<std::uint8_t>(static_cast<int>(std::lround(within_rim.y()))) + 3 * std::lround(within_rim.x());
  if (segmenter_.classify(p[0], p[1], p[2]) != disc.colour) return Look::kHidden;
  const auto at = half_way(profile, inside, outside);
  if (!at) return Look::kHidden;
  range = disc.radius + *at * kSampleStep / pixels_per_metre;
  return Look::kEdge;
}

std::optional<DiscFit> DiscFitter::fit(const cv::Mat3b& rgb, const DepthFrame* depth, const CircleGuess& guess,
                                       std::span<const CircleGuess> all, std::size_t self) const {
  CircleGuess disc = guess;
  std::vector<CircleGuess> near;
  // A wall shifts by at most height / (camera height - height) of the distance from the camera's foot; 30 mm covers the image's corners.
  constexpr double kNear = 0.030;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i != self && (all[i].p_WD - disc.p_WD).norm() < all[i].radius + disc.radius + kNear) near.push_back(all[i]);
  }

  std::vector<Edge> edges;
  std::vector<double> errors;
  edges.reserve(kDirections);
  errors.reserve(kDirections);
  int explained = 0;  // directions without an edge for a reason that says nothing against the disc
  double sigma = 0.0;
  Matrix3 normal;
  for (int pass = 0; pass < kPasses; ++pass) {
    edges.clear();
    explained = 0;
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2.0 * CV_PI * k / kDirections;
      const Vector2 n_W{std::cos(angle), std::sin(angle)};
      double range = 0.0;
      const Look seen = look(rgb, depth, disc, near, n_W, range);
      if (seen == Look::kEdge) edges.push_back({n_W, range, 1.0});
      if (seen == Look::kNeighbour || seen == Look::kNarrowWall) ++explained;
    }
    if (static_cast<double>(edges.size()) * 360.0 / kDirections < settings_.min_seen_arc_deg) return std::nullopt;

    // Robust least squares for the centre's shift and the radius; the errors are small, so two or three rounds settle it.
    Vector3 x{0.0, 0.0, disc.radius};
    for (int round = 0; round < 4; ++round) {
      errors.clear();
      for (const Edge& e : edges) errors.push_back(std::abs(e.range - x.z() - e.n_W.dot(x.head<2>())));
      sigma = std::max(1.4826 * median(errors), settings_.edge_sigma_floor);
      normal.setZero();
      Vector3 right = Vector3::Zero();
      for (Edge& e : edges) {
        const double error = (e.range - x.z() - e.n_W.dot(x.head<2>())) / (kTukey * sigma);
        const double inside = 1.0 - error * error;
        e.weight = inside > 0.0 ? inside * inside : 0.0;
        const Vector3 row{e.n_W.x(), e.n_W.y(), 1.0};
        normal += e.weight * row * row.transpose();
        right += e.weight * e.range * row;
      }
      const auto solver = normal.ldlt();
      if (solver.rcond() < 1e-6) return std::nullopt;
      x = solver.solve(right);
    }
    disc.p_WD += x.head<2>();
    disc.radius = x.z();
    if (!(disc.radius > 0.5 * settings_.radius_min && disc.radius < 2.0 * settings_.radius_max)) return std::nullopt;
  }
  if (disc.radius < settings_.radius_min || disc.radius > settings_.radius_max) return std::nullopt;

  const auto good = std::count_if(edges.begin(), edges.end(), [](const Edge& e) { return e.weight > 0.1; });
  DiscFit fit;
  fit.p_WD = disc.p_WD;
  fit.radius = disc.radius;
  fit.colour = guess.colour;
  fit.region = guess.region;
  fit.seen_share = static_cast<double>(good) / kDirections;
  fit.hidden_share = static_cast<double>(kDirections - explained - good) / kDirections;
  if (360.0 * fit.seen_share < settings_.min_seen_arc_deg) return std::nullopt;
  // Independent noise per edge point, plus an error that neighbouring points share and that therefore averages out more slowly.
  const double shared = settings_.edge_bias_sigma * settings_.edge_bias_sigma * kDirections / kBiasPatches;
  fit.covariance = (sigma * sigma + shared) * normal.inverse();
  return fit;
}

}  // namespace breakshot::perception
