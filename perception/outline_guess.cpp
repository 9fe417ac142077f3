#include "perception/outline_guess.hpp"

#include "perception/circle_moments.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace breakshot::perception {
namespace {

constexpr std::size_t kStride = 2;      // outline pixels per point: neighbours share their rounding
constexpr std::size_t kHoleStride = 1;  // the holes between discs are small
constexpr std::size_t kReach = 3;       // points to each side over which directions are taken
constexpr double kTolerance = 1.0e-3;   // m: an outline of whole pixels is off by half a pixel of 0.9 mm, plus as much for blur
constexpr double kFacing = 0.80;  // cosine of the angle between an outline's normal and the circle's: 6 px know it to 15 degrees or so
constexpr double kCorner = 0.45;  // rad: an outline that turns by so much more or less than discs do passes from one disc to another
constexpr std::size_t kLeastPoints = 3;  // of an arc
constexpr std::size_t kLeastToCut = 12;  // points: shorter arcs are not cut in two
constexpr double kMinArc = 1.0;          // rad: less of an outline says too little about a circle
constexpr double kShort = 2.6;           // rad: longer arcs know their circle without a second one
constexpr double kMinFill = 0.25;        // share of the circle that the patch must cover: more than half of it may be hidden behind the arm
constexpr double kOverlap = 4e-3;        // m by which two guesses may overlap: errors of both
constexpr int kSectors = 36;  // of a circumference, to count how much of it has points: no fewer than sectors on the smallest disc

struct OutlinePoint {
  Vector2 p_W, n_W;  // on the plane of its rim; out of the patch
  bool used = false;
};

struct Arc {
  std::size_t first = 0, count = 0;  // of the points
  Vector2 low{0.0, 0.0}, high{0.0, 0.0};
  CircleMoments moments;
};

struct Candidate {
  Circle circle;
  double arc = 0.0;  // rad of its circumference with unused points
};

class PatchSearch {
 public:
  PatchSearch(const View& view, const PerceptionSettings& settings, const ArmMask& arm, const Region& region)
      : view_{view}, settings_{settings}, arm_{arm}, region_{region} {
    const cv::Point middle = (region.box.tl() + region.box.br()) / 2;
    origin_ = view.camera.point_on_plane({middle.x, middle.y}, view.disc_height);
    for (const Outline& outline : region.outlines) add_outline(outline);
  }

  void find(std::vector<CircleGuess>& out, std::size_t region_index) {
    std::vector<Candidate> candidates = propose();
    std::vector<Circle> taken;
    while (!candidates.empty()) {
      const auto best = std::max_element(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) { return a.arc < b.arc; });
      // Counted again when it comes up: a better one may have taken some of its points since.
      const double arc = polish(best->circle);
      if (arc < 0.95 * best->arc) {
        best->arc = arc;
        if (arc < kMinArc) candidates.erase(best);
        continue;
      }
      const Circle circle = best->circle;
      candidates.erase(best);
      if (arc < kMinArc || !allowed(circle)) continue;
      const bool overlaps = std::any_of(taken.begin(), taken.end(), [&](const Circle& other) {
        return (other.p_WD - circle.p_WD).norm() < other.radius + circle.radius - kOverlap;
      });
      if (overlaps || fill(circle) < kMinFill) continue;
      use_up(circle);
      taken.push_back(circle);
      out.push_back({circle.p_WD, circle.radius, region_.colour, region_index});
    }
  }

 private:
  void add_outline(const Outline& outline) {
    // Points on the image's border are where the image ends, not where the disc does.
    const auto foreign = [&](const cv::Point& p) {
      return p.x <= 1 || p.y <= 1 || p.x >= view_.camera.width - 2 || p.y >= view_.camera.height - 2 || arm_.covers({p.x, p.y});
    };
    const std::vector<cv::Point>& pixels = outline.points;
    const std::size_t stride = outline.hole ? kHoleStride : kStride;
    const std::size_t n = pixels.size() / stride;
    if (n < 2 * kReach + 2) return;
    std::vector<Vector2> tops(n);
    std::vector<bool> bad(n);
    for (std::size_t i = 0; i < n; ++i) {
      // The mean of three neighbours: half of the rounding goes.
      const cv::Point& at = pixels[i * stride];
      const cv::Point sum = pixels[(i * stride + pixels.size() - 1) % pixels.size()] + at + pixels[(i * stride + 1) % pixels.size()];
      tops[i] = view_.camera.point_on_plane(Vector2{sum.x, sum.y} / 3.0, view_.disc_height);
      bad[i] = foreign(at);
    }
    double area = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector2 a = tops[i] - origin_, b = tops[(i + 1) % n] - origin_;
      area += a.x() * b.y() - a.y() * b.x();
    }
    const double side = (area > 0.0) != outline.hole ? 1.0 : -1.0;  // of the way along the outline: on its right, out of the patch

    // Turning over kReach points to each side, against what the outline of a disc of any size turns.
    const auto chord = [&](std::size_t from, std::size_t to) { return Vector2{tops[to % n] - tops[from % n]}; };
    for (std::size_t i = 0; i < n; ++i) {
      const Vector2 in = chord(i + n - kReach, i), along = chord(i, i + kReach);
      const double turn = side * std::atan2(in.x() * along.y() - in.y() * along.x(), in.dot(along));
      const double most = 0.5 * (in.norm() + along.norm()) / settings_.radius_min;
      if (turn < -kCorner || turn > most + kCorner) bad[i] = true;
    }

    const double half_pixel = 0.5 * (view_.camera.X_WC.translation().z() - view_.disc_height) / view_.camera.fx;
    const auto append = [&](std::size_t i) {
      const Vector2 way = chord(i + n - kReach, i + kReach);
      OutlinePoint point;
      point.n_W = side * Vector2{way.y(), -way.x()}.normalized();
      const bool top = (tops[i] - view_.foot()).dot(point.n_W) > 0.0;
      // The pixels of a patch's rim lie inside it.
      point.p_W = (top ? tops[i] : view_.base_of_ray(tops[i])) + half_pixel * point.n_W;
      points_.push_back(point);
    };
    const auto start = std::find(bad.begin(), bad.end(), true);
    if (start == bad.end()) {
      const std::size_t first = points_.size();
      for (std::size_t i = 0; i < n; ++i) append(i);
      close_arc(first);
      return;
    }
    const auto offset = static_cast<std::size_t>(start - bad.begin());
    std::size_t first = points_.size();
    for (std::size_t k = 1; k <= n; ++k) {
      const std::size_t i = (offset + k) % n;
      if (!bad[i]) {
        append(i);
        continue;
      }
      close_arc(first);
      first = points_.size();
    }
  }

  // Makes an arc of the points from `first` on; cuts in two what is no arc of one circle.
  void close_arc(std::size_t first) { add_arc(first, points_.size() - first); }

  void add_arc(std::size_t first, std::size_t count) {
    if (count < kLeastPoints) return;
    Arc arc;
    arc.first = first;
    arc.count = count;
    arc.low = arc.high = points_[first].p_W;
    for (std::size_t i = first; i < first + count; ++i) {
      arc.moments.add(points_[i].p_W - origin_);
      arc.low = arc.low.cwiseMin(points_[i].p_W);
      arc.high = arc.high.cwiseMax(points_[i].p_W);
    }
    double rms = 0.0;
    if (count >= kLeastToCut) {
      const auto circle = arc.moments.fit(rms);
      if (circle && rms > 0.7 * kTolerance) {
        add_arc(first, count / 2);
        add_arc(first + count / 2, count - count / 2);
        return;
      }
    }
    arcs_.push_back(arc);
  }

  bool allowed(const Circle& circle) const noexcept {
    return circle.radius > 0.8 * settings_.radius_min && circle.radius < 1.2 * settings_.radius_max;
  }

  std::vector<Candidate> propose() {
    std::vector<Candidate> candidates;
    const auto consider = [&](const CircleMoments& moments) {
      double rms = 0.0;
      auto circle = moments.fit(rms);
      if (!circle || rms > kTolerance) return 0.0;
      circle->p_WD += origin_;
      if (!(circle->radius > 0.5 * settings_.radius_min && circle->radius < 2.0 * settings_.radius_max)) return 0.0;
      const double arc = polish(*circle);
      if (arc < kMinArc || !allowed(*circle)) return arc;
      const bool known = std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
        return (c.circle.p_WD - circle->p_WD).norm() + std::abs(c.circle.radius - circle->radius) < 0.3 * kTolerance;
      });
      if (!known) candidates.push_back({*circle, arc});
      return arc;
    };
    std::vector<double> own(arcs_.size());
    for (std::size_t i = 0; i < arcs_.size(); ++i) own[i] = consider(arcs_[i].moments);
    for (std::size_t i = 0; i < arcs_.size(); ++i) {
      for (std::size_t k = i + 1; k < arcs_.size(); ++k) {
        if (own[i] > kShort || own[k] > kShort || !near(arcs_[i], arcs_[k])) continue;
        CircleMoments both = arcs_[i].moments;
        both += arcs_[k].moments;
        consider(both);
      }
    }
    return candidates;
  }

  // Whether one disc may reach both, and turns its outside to both.
  bool near(const Arc& a, const Arc& b) const noexcept {
    const Vector2 way = 0.5 * (b.low + b.high) - 0.5 * (a.low + a.high);
    if (way.norm() > 2.4 * settings_.radius_max) return false;
    const Vector2& n_a = points_[a.first + a.count / 2].n_W;
    const Vector2& n_b = points_[b.first + b.count / 2].n_W;
    return n_a.dot(way) < n_b.dot(way);
  }

  template <typename Visit>
  void for_each_on(const Circle& circle, Visit&& visit) {
    const double outer = circle.radius + kTolerance;
    for (const Arc& arc : arcs_) {
      if (arc.high.x() < circle.p_WD.x() - outer || arc.low.x() > circle.p_WD.x() + outer || arc.high.y() < circle.p_WD.y() - outer ||
          arc.low.y() > circle.p_WD.y() + outer) {
        continue;
      }
      for (std::size_t i = arc.first; i < arc.first + arc.count; ++i) {
        OutlinePoint& point = points_[i];
        if (point.used) continue;
        const Vector2 from_centre = point.p_W - circle.p_WD;
        const double range = from_centre.norm();
        const double error = range - circle.radius;
        if (std::abs(error) > kTolerance || from_centre.dot(point.n_W) < kFacing * range) continue;
        visit(point, from_centre, error);
      }
    }
  }

  // Least squares over the unused points that agree, twice. @return how much of the circumference they are on, rad
  double polish(Circle& circle) {
    std::array<bool, kSectors> sectors{};
    for (int pass = 0; pass < 3; ++pass) {
      Matrix3 normal = 1e-9 * Matrix3::Identity();
      Vector3 right = Vector3::Zero();
      sectors.fill(false);
      for_each_on(circle, [&](const OutlinePoint&, const Vector2& from_centre, double error) {
        const Vector2 n = from_centre.normalized();
        const Vector3 row{n.x(), n.y(), 1.0};
        normal += row * row.transpose();
        right += row * error;
        const double turn = std::atan2(n.y(), n.x()) / (2.0 * CV_PI) + 0.5;
        sectors[std::min<std::size_t>(kSectors - 1, static_cast<std::size_t>(turn * kSectors))] = true;
      });
      if (pass == 2) break;
      const Vector3 step = normal.ldlt().solve(right);
      circle.p_WD += step.head<2>();
      circle.radius += step.z();
    }
    return 2.0 * CV_PI / kSectors * static_cast<double>(std::count(sectors.begin(), sectors.end(), true));
  }

  void use_up(const Circle& circle) {
    for_each_on(circle, [](OutlinePoint& point, const Vector2&, double) { point.used = true; });
  }

  // Share of the circle's inside, as far as it can be seen, that belongs to the patch.
  double fill(const Circle& circle) const {
    int inside = 0;
    int seen = 0;
    for (int ring = 1; ring <= 3; ++ring) {
      for (int k = 0; k < 16; ++k) {
        const double angle = 2.0 * CV_PI * k / 16.0;
        const Vector2 p = circle.p_WD + circle.radius * (0.28 * ring) * Vector2{std::cos(angle), std::sin(angle)};
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
  Vector2 origin_{0.0, 0.0};
  std::vector<OutlinePoint> points_;
  std::vector<Arc> arcs_;
};

}  // namespace

OutlineGuesser::OutlineGuesser(const View& view, const PerceptionSettings& settings, const ArmMask& arm)
    : view_{view}, settings_{settings}, arm_{arm} {}

std::vector<CircleGuess> OutlineGuesser::guess(std::span<const Region> regions) const {
  std::vector<CircleGuess> guesses;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].colour != kNoColour) PatchSearch{view_, settings_, arm_, regions[i]}.find(guesses, i);
  }
  return guesses;
}

}  // namespace breakshot::perception
