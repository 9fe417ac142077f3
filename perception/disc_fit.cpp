#include "perception/disc_fit.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace breakshot::perception {
namespace {

constexpr int kDirections = 144;     // one per 1.5 px of a 30 mm disc's outline: closer ones would share their pixels' noise
constexpr int kRoughly = 2;          // of a guess only every second one: it is fitted again anyway
constexpr double kSampleStep = 0.5;  // px, along a profile across the rim
// Half a profile's length, px, per pass. The first must bridge the guess's error; the others stay close to the edge, where shadows and
// bevels have no room to change the colours that the two sides are measured by.
constexpr std::array<double, 2> kReach{3.5, 1.5};
constexpr double kClear = 2.5;  // px beyond the rim that no neighbour may reach: half a profile and the neighbour's blur
constexpr std::size_t kMaxSamples = 15;
constexpr double kRimBlur = 1.5;  // px: from there on an edge's blur has faded
constexpr double kMinContrast =
    15.0;  // distance of the two sides in RGB under the reference light, [0, 255]: five times the noise of a sample
// Weight of an edge where the wall meets the table beside one of the top rim: shadow there shifts it by some 0.05 px, by more or less under
// other lamps.
constexpr double kTrustInFoot = 0.2;
constexpr double kTukey = 4.685;         // 95 % efficiency for normal errors (Holland and Welsch 1977)
constexpr double kPatches = 8.0;         // of an outline that share one draw of edge_patch_sigma
constexpr double kRadiusSlack = 0.5e-3;  // m
constexpr double kAgree = 4.0;           // of edge_sigma_floor: edges this near to a circle agree with it
constexpr double kLeastSeen = 0.10;      // share of the outline below which not even neighbours all around excuse a disc
constexpr double kVaguest = 0.7e-3;      // m: standard deviation of a centre that is worth reporting
constexpr double kMostlySeen = 0.08;     // share of the outline that highlights and noise may cost a disc in full view

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

// How much of a colour is the disc's and how much is what lies outside.
//
// Usually the two differ in hue: the colour is then split into a part along `inside` and one along `outside`. Beside a sharp edge both sides may
// be brighter or darker than the sample that they are told by (a bevel, a wall that darkens towards its foot, the brim of a shadow): the outside's
// part of the sum hardly follows that, as long as it happens to both alike. Where the inside of the sample is another face than the one
// that ends here (the top face past a narrow wall), only the outside's part itself means something. Where the two are nearly parallel (a grey
// disc, deep shadow) the answer is the place between them.
class Mixture {
 public:
  enum class By : std::uint8_t { kShare, kOutside };

  Mixture(const Colour& inside, const Colour& outside, By by, float level) noexcept {
    const float dot = inside.dot(outside);
    const float cosine = dot / std::max(1e-6F, inside.norm() * outside.norm());
    by_hue_ = 1.0F - cosine * cosine > kMinSine * kMinSine && std::min(inside.norm(), outside.norm()) > level * kMinLight;
    // The part of `outside` that is perpendicular to `inside` measures the outside whatever the disc's brightness, and the other way round.
    axis_ = by_hue_ ? Colour{outside - inside * (dot / inside.squaredNorm())} : Colour{outside - inside};
    axis_ /= axis_.squaredNorm();
    origin_ = by_hue_ ? 0.0F : inside.dot(axis_);
    if (!by_hue_ || by == By::kOutside) return;
    sum_ = Colour{inside - outside * (dot / outside.squaredNorm())};
    sum_ = sum_ / sum_.squaredNorm() + axis_;
    of_sum_ = true;
  }
  bool by_hue() const noexcept { return by_hue_; }
  /// 0 inside, 1 outside.
  float outside_share(const Colour& colour) const noexcept {
    const float outside = colour.dot(axis_) - origin_;
    return of_sum_ ? outside / std::max(kLeastSum, colour.dot(sum_)) : outside;
  }

 private:
  static constexpr float kMinSine = 0.15F;  // of the angle between the two colours: below, noise grows by more than six
  static constexpr float kMinLight = 12.0F;
  static constexpr float kLeastSum = 0.1F;
  Colour axis_, sum_{0.0F, 0.0F, 0.0F};
  float origin_ = 0.0F;
  bool by_hue_ = false, of_sum_ = false;
};

// Where a profile passes half-way from its inside to its outside, in samples from its middle; nothing when it does not.
std::optional<double> half_way(std::span<const Colour> profile, const Mixture& mixture) noexcept {
  const double middle = static_cast<double>(profile.size() - 1) / 2.0;
  std::optional<double> nearest;
  float previous = mixture.outside_share(profile[0]);
  for (std::size_t i = 1; i < profile.size(); ++i) {
    const float next = mixture.outside_share(profile[i]);
    if (previous <= 0.5F && next > 0.5F) {
      const double at = static_cast<double>(i - 1) + static_cast<double>((0.5F - previous) / (next - previous)) - middle;
      if (!nearest || std::abs(at) < std::abs(*nearest)) nearest = at;
    }
    previous = next;
  }
  return nearest;
}

// (x, y, radius) of the circle that most edges agree with, beside the one they were measured about.
//
// What covers a disc in part has edges too. They are no circle with the disc's own, so least squares, however robust, would settle on neither
// where they are many. Tries three edges at a time, at several spacings all around: the same for the same edges.
Vector3 circle_of_most(std::span<const DiscFitter::Edge> edges, double tolerance) {
  const std::size_t n = edges.size();
  Vector3 best = Vector3::Zero();
  std::ptrdiff_t most = 0;
  for (const std::size_t share : {12, 8, 5, 3}) {
    const std::size_t step = std::max<std::size_t>(1, n / share);
    for (std::size_t first = 0; first < n; first += 3) {
      Matrix3 rows;
      Vector3 ranges;
      for (int i = 0; i < 3; ++i) {
        const auto& edge = edges[(first + static_cast<std::size_t>(i) * step) % n];
        rows.row(i) << edge.n_W.x(), edge.n_W.y(), 1.0;
        ranges[i] = edge.range;
      }
      if (std::abs(rows.determinant()) < 1e-3) continue;
      const Vector3 x = rows.inverse() * ranges;
      const auto agree = std::count_if(edges.begin(), edges.end(), [&](const auto& edge) { return std::abs(edge.error(x)) < tolerance; });
      if (agree <= most) continue;
      most = agree;
      best = x;
    }
  }
  return best;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

DiscFitter::DiscFitter(const View& view, const PerceptionSettings& settings, const Segmenter& segmenter, const ArmMask& arm)
    : view_{view}, settings_{settings}, segmenter_{segmenter}, arm_{arm} {
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2.0 * CV_PI * k / kDirections;
    directions_.emplace_back(std::cos(angle), std::sin(angle));
  }
  const Matrix3 R_WC = view.camera.X_WC.linear();
  up_C_ = R_WC.row(2).transpose();
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
  const double rise = up_C_.x() * (x - camera.cx) / camera.fx + up_C_.y() * (y - camera.cy) / camera.fy + up_C_.z();
  return camera.X_WC.translation().z() + range * rise > settings_.occluder_height;
}

void DiscFitter::adapt(const TableLight& light) noexcept {
  const double factor = 3.0 / (light.gain[0] + light.gain[1] + light.gain[2]);
  level_ = static_cast<float>(std::min(1.0, std::pow(factor, settings_.edge_gamma)));
}

// What neighbours hide does not count against a disc: in a dense pack little of an outline shows, but all around.
bool DiscFitter::too_little(std::size_t seen, int explained, int directions) const noexcept {
  const double share = static_cast<double>(seen) / directions;
  const double free = 1.0 - static_cast<double>(explained) / directions;
  return share < kLeastSeen || share < settings_.min_seen_arc_deg / 360.0 * free;
}

DiscFitter::Look DiscFitter::look(const cv::Mat3b& rgb, const DepthFrame* depth, const CircleGuess& disc, std::span<const CircleGuess> near,
                                  double reach, Edge& edge) const {
  const Vector2& n_W = edge.n_W;
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

  // What lies just outside, along its ray from the plane of the top faces down to the table.
  const Vector2 far_end = rim + std::max(reach, kClear) / pixels_per_metre * n_W;
  const Vector2 ray_top = top ? far_end : view_.top_of_ray(far_end);
  const Vector2 ray_base = top ? view_.base_of_ray(far_end) : far_end;
  for (const auto& other : near) {
    if (distance_to_segment(other.p_WD, ray_top, ray_base) < other.radius) return Look::kNeighbour;
  }

  const auto samples = static_cast<std::size_t>(2.0 * reach / kSampleStep) + 1;
  const Vector2 inner = *pixel - reach / kSampleStep * step;
  const Vector2 outer = *pixel + reach / kSampleStep * step;
  const auto within = [&](const Vector2& p) { return p.x() >= 0.0 && p.y() >= 0.0 && p.x() < rgb.cols - 1 && p.y() < rgb.rows - 1; };
  if (!within(inner) || !within(outer)) return Look::kHidden;
  if (arm_.covers(inner) || arm_.covers(outer)) return Look::kHidden;
  if (depth != nullptr && (occluded(*depth, inner) || occluded(*depth, outer) || occluded(*depth, *pixel + 16.0 * step)))
    return Look::kHidden;
  // The arm, or a highlight: asked of the pixel itself, as the colour table speaks of encoded values.
  const std::uint8_t* p = rgb.ptr<std::uint8_t>(static_cast<int>(inner.y() + 0.5)) + 3 * static_cast<int>(inner.x() + 0.5);
  if (segmenter_.classify(p[0], p[1], p[2]) != disc.colour) return Look::kNothing;

  std::array<Colour, kMaxSamples> buffer;
  const std::span profile = std::span{buffer}.first(samples);
  for (std::size_t i = 0; i < samples; ++i) profile[i] = sample(rgb, light_, inner + static_cast<double>(i) * step);
  const Colour inside = (profile[0] + profile[1]) / 2.0F;
  const Colour outside = (profile[samples - 1] + profile[samples - 2]) / 2.0F;
  if ((inside - outside).norm() < level_ * static_cast<float>(kMinContrast)) return Look::kNothing;
  // Past a narrow wall the inside of the profile is the top face: brighter than the wall, so only hue finds the wall's edge.
  const bool narrow = !top && view_.wall_width(disc.p_WD, disc.radius, n_W) * pixels_per_metre < reach + kRimBlur;
  const Mixture mixture{inside, outside, narrow ? Mixture::By::kOutside : Mixture::By::kShare, level_};
  if (narrow && !mixture.by_hue()) return Look::kNarrowWall;
  const auto at = half_way(profile, mixture);
  if (!at) return Look::kNothing;
  edge.range = disc.radius + *at * kSampleStep / pixels_per_metre;
  edge.trust = top ? 1.0 : kTrustInFoot;
  return Look::kEdge;
}

std::optional<DiscFit> DiscFitter::fit(const cv::Mat3b& rgb, const DepthFrame* depth, const CircleGuess& guess,
                                       std::span<const CircleGuess> all, std::size_t self, bool fitted_before) const {
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
  const int stride = fitted_before ? 1 : kRoughly;
  const int directions = kDirections / stride;
  int known_hidden = 0;
  int explained = 0;  // directions without an edge for a reason that says nothing against the disc
  double sigma = 0.0;
  Matrix3 normal{Matrix3::Zero()};
  for (const double reach : std::span{kReach}.subspan(fitted_before ? 1 : 0)) {
    edges.clear();
    explained = known_hidden = 0;
    for (int k = 0; k < kDirections; k += stride) {
      Edge edge;
      edge.n_W = directions_[static_cast<std::size_t>(k)];
      const Look seen = look(rgb, depth, disc, near, reach, edge);
      if (seen == Look::kEdge) edges.push_back(edge);
      if (seen == Look::kHidden) ++known_hidden;
      if (seen == Look::kNeighbour || seen == Look::kNarrowWall) ++explained;
    }
    // Something may cover the disc: its edges must not bend the circle.
    if (directions - explained - static_cast<int>(edges.size()) > kMostlySeen * directions) {
      const double tolerance = kAgree * settings_.edge_sigma_floor;
      const Vector3 most = circle_of_most(edges, tolerance);
      std::erase_if(edges, [&](const Edge& edge) { return std::abs(edge.error(most)) > tolerance; });
    }
    if (too_little(edges.size(), explained, directions)) return std::nullopt;

    // Robust least squares for the centre's shift and the radius; the errors are small, so two or three rounds settle it.
    Vector3 x{0.0, 0.0, disc.radius};
    for (int round = 0; round < 4; ++round) {
      errors.clear();
      for (const Edge& e : edges) errors.push_back(std::abs(e.error(x)));
      sigma = std::max(1.4826 * median(errors), settings_.edge_sigma_floor);
      normal.setZero();
      Vector3 right = Vector3::Zero();
      for (Edge& e : edges) {
        const double error = e.error(x) / (kTukey * sigma);
        const double inside = 1.0 - error * error;
        e.weight = inside > 0.0 ? inside * inside : 0.0;
        const Vector3 row{e.n_W.x(), e.n_W.y(), 1.0};
        normal += e.trust * e.weight * row * row.transpose();
        right += e.trust * e.weight * e.range * row;
      }
      const auto solver = normal.ldlt();
      if (solver.rcond() < 1e-6) return std::nullopt;
      x = solver.solve(right);
    }
    disc.p_WD += x.head<2>();
    disc.radius = x.z();
    if (!(disc.radius > 0.5 * settings_.radius_min && disc.radius < 2.0 * settings_.radius_max)) return std::nullopt;
  }
  // The limits are those of true radii.
  if (disc.radius < settings_.radius_min - kRadiusSlack || disc.radius > settings_.radius_max + kRadiusSlack) return std::nullopt;

  const auto good = std::count_if(edges.begin(), edges.end(), [](const Edge& e) { return e.weight > 0.1; });
  DiscFit fit;
  fit.p_WD = disc.p_WD;
  fit.radius = disc.radius;
  fit.colour = guess.colour;
  fit.region = guess.region;
  fit.seen_share = static_cast<double>(good) / directions;
  fit.hidden_share = static_cast<double>(directions - explained - good) / directions;
  fit.missing_share = std::max(0.0, fit.hidden_share - static_cast<double>(known_hidden) / directions);
  fit.complete = fit.hidden_share < kMostlySeen;
  if (too_little(static_cast<std::size_t>(good), explained, directions)) return std::nullopt;
  // Points that share an error count as one.
  const double patch = settings_.edge_patch_sigma * settings_.edge_patch_sigma * directions / kPatches;
  fit.covariance = (sigma * sigma + patch) * normal.inverse();
  if (fit.covariance.topLeftCorner<2, 2>().trace() > kVaguest * kVaguest) return std::nullopt;
  fit.covariance(2, 2) += settings_.edge_common_sigma * settings_.edge_common_sigma;
  return fit;
}

}  // namespace breakshot::perception
