#include "perception/disc_fit.hpp"

#include "perception/rim_circle.hpp"
#include "perception/rim_edge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace breakshot::perception {
namespace {

constexpr int kDirections = 144;  // one per 1.5 px of a 30 mm disc's outline: closer ones would share their pixels
constexpr int kRoughly = 2;       // of a guess only every second one: it is fitted again anyway
// Half the length of a line across the rim, px, per pass. The first must bridge the guess's error; the others stay close to the edge.
constexpr std::array<double, 2> kReach{kMaxReach, kExactReach};
constexpr double kRimBlur = 1.5;                   // px: from there on an edge's blur has faded
constexpr double kClear = kExactReach + kRimBlur;  // px beyond the rim that no neighbour may reach
// Of a pixel's square and of the interpolation between pixels along an edge, px^2: by half of it over the radius a blurred circle looks smaller.
constexpr double kBlurVariance = 0.25;
// Weights of edges beside those of the top rim. Past a narrow wall the contact shadow shifts them, by more or less under other lamps.
constexpr double kTrustInFoot = 0.8, kTrustInNarrowFoot = 0.2;
constexpr double kRadiusSlack = 0.5e-3;  // m
constexpr double kAgree = 4.0;           // of edge_sigma_floor: edges this near to a circle agree with it
constexpr double kLeastSeen = 0.10;      // share of the outline below which not even neighbours all around excuse a disc
constexpr double kVaguest = 0.7e-3;      // m: standard deviation of a centre that is worth reporting
constexpr double kMostlySeen = 0.08;     // share of the outline that highlights and noise may cost a disc in full view

// Distance of point c from the segment ab.
double distance_to_segment(const Vector2& c, const Vector2& a, const Vector2& b) noexcept {
  const Vector2 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((c - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (a + t * ab - c).norm();
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
  const Vector2 outward = across.normalized();

  // What lies just outside, along its ray from the plane of the top faces down to the table.
  const Vector2 far_end = rim + std::max(reach, kClear) / pixels_per_metre * n_W;
  const Vector2 ray_top = top ? far_end : view_.top_of_ray(far_end);
  const Vector2 ray_base = top ? view_.base_of_ray(far_end) : far_end;
  for (const auto& other : near) {
    if (distance_to_segment(other.p_WD, ray_top, ray_base) < other.radius) return Look::kNeighbour;
  }

  const Vector2 inner = *pixel - reach * outward;
  const Vector2 outer = *pixel + reach * outward;
  const auto within = [&](const Vector2& p) { return p.x() >= 0.0 && p.y() >= 0.0 && p.x() < rgb.cols - 1 && p.y() < rgb.rows - 1; };
  if (!within(inner) || !within(outer)) return Look::kHidden;
  if (arm_.covers(inner) || arm_.covers(outer)) return Look::kHidden;
  if (depth != nullptr && (occluded(*depth, inner) || occluded(*depth, outer) || occluded(*depth, *pixel + 8.0 * outward)))
    return Look::kHidden;
  // The arm, or a highlight: asked of the pixel itself, as the colour table speaks of encoded values.
  const std::uint8_t* p = rgb.ptr<std::uint8_t>(static_cast<int>(inner.y() + 0.5)) + 3 * static_cast<int>(inner.x() + 0.5);
  if (segmenter_.classify(p[0], p[1], p[2]) != disc.colour) return Look::kNothing;

  const double wall_px = view_.wall_width(disc.p_WD, disc.radius, n_W) * pixels_per_metre;
  const Rim rim_kind = top ? Rim::kTop : wall_px < reach + kRimBlur ? Rim::kNarrowFoot : Rim::kFoot;
  const RimLine line{rgb, light_, *pixel, outward};
  const auto found = reach > kExactReach ? find_edge(line, rim_kind, reach, level_) : measure_edge(line, rim_kind, level_);
  if (!found) return rim_kind == Rim::kNarrowFoot ? Look::kNarrowWall : Look::kNothing;
  edge.range = disc.radius + (found->at + 0.5 * kBlurVariance / (disc.radius * pixels_per_metre)) / pixels_per_metre;
  edge.foot = !top;
  edge.trust = found->trust * (top ? 1.0 : rim_kind == Rim::kFoot ? kTrustInFoot : kTrustInNarrowFoot);
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

  const SharedErrors errors{settings_.edge_sigma_floor, settings_.edge_patch_sigma, settings_.edge_foot_sigma, settings_.edge_arc_sigma};
  std::vector<Edge> edges;
  edges.reserve(kDirections);
  const int stride = fitted_before ? 1 : kRoughly;
  const int directions = kDirections / stride;
  int known_hidden = 0;
  int explained = 0;  // directions without an edge for a reason that says nothing against the disc
  std::optional<RimCircle> circle;
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

    circle = fit_circle(edges, disc.radius, directions, errors);
    if (!circle) return std::nullopt;
    disc.p_WD += circle->x.head<2>();
    disc.radius = circle->x.z();
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
  fit.covariance = circle->covariance;
  if (fit.covariance.topLeftCorner<2, 2>().trace() > kVaguest * kVaguest) return std::nullopt;
  fit.covariance(2, 2) += settings_.edge_common_sigma * settings_.edge_common_sigma;
  return fit;
}

}  // namespace breakshot::perception
