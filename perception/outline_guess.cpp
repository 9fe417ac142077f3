#include "perception/outline_guess.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

namespace breakshot::perception {
namespace {

constexpr double kTolerance = 1.3e-3;    // m: an outline of whole pixels is off by half a pixel of 0.9 mm, plus as much for blur
constexpr std::size_t kMaxPoints = 160;  // per patch; more do not sharpen a guess that is good to a pixel anyway
constexpr int kTrials = 80;              // an arc of a third of the points is then missed once in 1e5 (0.87^80)
constexpr double kGoodShare = 0.85;      // of the points: no need to look for better
constexpr double kMinArc = 1.0;          // rad: less of an outline says too little about a circle
constexpr double kMinFill = 0.25;        // share of the circle that the patch must cover: more than half of it may be hidden behind the arm

struct OutlinePoint {
  Vector2 top, base;  // where its ray meets the plane of the top faces and the table, m
};

struct Circle {
  Vector2 centre;
  double radius;
};

std::optional<Circle> through(const Vector2& a, const Vector2& b, const Vector2& c) {
  const Vector2 u = b - a;
  const Vector2 v = c - a;
  const double cross = 2.0 * (u.x() * v.y() - u.y() * v.x());
  if (std::abs(cross) < 1e-9) return std::nullopt;
  const Vector2 to_centre =
      Vector2{v.y() * u.squaredNorm() - u.y() * v.squaredNorm(), u.x() * v.squaredNorm() - v.x() * u.squaredNorm()} / cross;
  return Circle{a + to_centre, to_centre.norm()};
}

class PatchSearch {
 public:
  PatchSearch(const View& view, const PerceptionSettings& settings, const ArmMask& arm, const Region& region)
      : view_{view}, settings_{settings}, arm_{arm}, region_{region} {
    // Points on the image's border are where the image ends, not where the disc does.
    const auto on_border = [&](const cv::Point& p) {
      return p.x <= 1 || p.y <= 1 || p.x >= view_.camera.width - 2 || p.y >= view_.camera.height - 2;
    };
    const std::size_t stride = 1 + region.outline.size() / kMaxPoints;
    for (std::size_t i = 0; i < region.outline.size(); i += stride) {
      if (on_border(region.outline[i])) continue;
      const Vector2 pixel{region.outline[i].x, region.outline[i].y};
      if (arm_.covers(pixel)) continue;
      const Vector2 top = view_.camera.point_on_plane(pixel, view_.disc_height);
      points_.push_back({top, view_.base_of_ray(top)});
    }
    spacing_ = mean_spacing();
  }

  void find(std::minstd_rand& random, std::vector<CircleGuess>& out, std::size_t region_index) {
    while (static_cast<double>(points_.size()) * spacing_ > kMinArc * settings_.radius_min) {
      const auto best = best_circle(random);
      if (!best) return;
      const double arc = static_cast<double>(inliers(*best)) * spacing_ / best->radius;
      if (arc < kMinArc) return;
      std::erase_if(points_, [&](const OutlinePoint& p) { return std::abs(distance(*best, p)) < 2.0 * kTolerance; });
      if (fill(*best) < kMinFill) continue;
      out.push_back({best->centre, best->radius, region_.colour, region_index});
    }
  }

 private:
  double mean_spacing() const {
    std::vector<double> steps;
    for (std::size_t i = 1; i < points_.size(); ++i) steps.push_back((points_[i].top - points_[i - 1].top).norm());
    if (steps.empty()) return 0.0;
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
    return steps[steps.size() / 2];
  }

  // Signed distance of an outline point from the circle, on the plane of the rim that bounds the silhouette there.
  double distance(const Circle& circle, const OutlinePoint& p) const noexcept {
    const Vector2 from_centre = p.top - circle.centre;
    const double range = from_centre.norm();
    if (range == 0.0) return -circle.radius;
    if (view_.top_rim_bounds(circle.centre, circle.radius, from_centre / range)) return range - circle.radius;
    return (p.base - circle.centre).norm() - circle.radius;
  }

  std::size_t inliers(const Circle& circle) const noexcept {
    return static_cast<std::size_t>(
        std::count_if(points_.begin(), points_.end(), [&](const OutlinePoint& p) { return std::abs(distance(circle, p)) < kTolerance; }));
  }

  std::optional<Circle> best_circle(std::minstd_rand& random) const {
    std::optional<Circle> best;
    std::size_t most = 0;
    const std::size_t n = points_.size();
    if (n < 6) return std::nullopt;
    // The three points span a sixth of a small disc's outline up to two thirds of the whole: neighbours on the outline belong together.
    const auto shortest = std::max<std::size_t>(2, static_cast<std::size_t>(0.5 * settings_.radius_min / spacing_));
    const std::size_t longest = std::max(shortest + 1, n / 3);
    for (int trial = 0; trial < kTrials; ++trial) {
      const std::size_t first = random() % n;
      const std::size_t step = shortest + random() % (longest - shortest);
      const auto circle = through(points_[first].top, points_[(first + step) % n].top, points_[(first + 2 * step) % n].top);
      if (!circle || circle->radius < 0.8 * settings_.radius_min || circle->radius > 1.2 * settings_.radius_max) continue;
      const std::size_t count = inliers(*circle);
      if (count <= most) continue;
      most = count;
      best = circle;
      if (static_cast<double>(most) > kGoodShare * static_cast<double>(n)) break;
    }
    if (best) polish(*best);
    return best;
  }

  // Least squares over the points that agree: three points alone carry their pixel noise into the circle.
  void polish(Circle& circle) const {
    for (int pass = 0; pass < 2; ++pass) {
      Matrix3 normal = 1e-12 * Matrix3::Identity();
      Vector3 right = Vector3::Zero();
      for (const auto& p : points_) {
        const double error = distance(circle, p);
        if (std::abs(error) > kTolerance) continue;
        const Vector2 n = (p.top - circle.centre).normalized();
        const Vector3 row{n.x(), n.y(), 1.0};
        normal += row * row.transpose();
        right += row * error;
      }
      const Vector3 step = normal.ldlt().solve(right);
      circle.centre += step.head<2>();
      circle.radius += step.z();
    }
  }

  // Share of the circle's inside, as far as it can be seen, that belongs to the patch.
  double fill(const Circle& circle) const {
    int inside = 0;
    int seen = 0;
    for (int ring = 1; ring <= 3; ++ring) {
      for (int k = 0; k < 16; ++k) {
        const double angle = 2.0 * CV_PI * k / 16.0;
        const Vector2 p = circle.centre + circle.radius * (0.28 * ring) * Vector2{std::cos(angle), std::sin(angle)};
        const auto pixel = view_.camera.project({p.x(), p.y(), view_.disc_height});
        if (!pixel) continue;
        const cv::Point at{static_cast<int>(std::lround(pixel->x())), static_cast<int>(std::lround(pixel->y()))};
        if (at.x < 0 || at.y < 0 || at.x >= view_.camera.width || at.y >= view_.camera.height || arm_.covers(*pixel)) continue;
        ++seen;
        if (region_.box.contains(at) && region_.mask(at - region_.box.tl()) != 0) ++inside;
      }
    }
    return seen == 0 ? 0.0 : static_cast<double>(inside) / seen;
  }

  const View& view_;
  const PerceptionSettings& settings_;
  const ArmMask& arm_;
  const Region& region_;
  std::vector<OutlinePoint> points_;
  double spacing_ = 0.0;  // between neighbouring points, m
};

}  // namespace

OutlineGuesser::OutlineGuesser(const View& view, const PerceptionSettings& settings, const ArmMask& arm)
    : view_{view}, settings_{settings}, arm_{arm} {}

std::vector<CircleGuess> OutlineGuesser::guess(std::span<const Region> regions) const {
  std::minstd_rand random{1};
  std::vector<CircleGuess> guesses;
  for (std::size_t i = 0; i < regions.size(); ++i) PatchSearch{view_, settings_, arm_, regions[i]}.find(random, guesses, i);
  return guesses;
}

}  // namespace breakshot::perception
