#include "perception/annotate.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

namespace breakshot::perception {
namespace {

// RGB.
const cv::Scalar kWhite{255, 255, 255}, kInk{24, 27, 32}, kRed{255, 72, 66}, kAmber{255, 190, 60}, kGreen{96, 222, 128},
    kBlue{90, 200, 255}, kPale{176, 196, 214};

constexpr int kFraction = 4;            // bits of sub-pixel coordinates
constexpr double kTouchDrawn = 0.5e-3;  // m: narrower gaps are drawn as contacts
const int kFont = cv::FONT_HERSHEY_DUPLEX;

cv::Point fine(const cv::Point2d& p) {
  constexpr double kUnit = 1 << kFraction;
  return {cvRound(p.x * kUnit), cvRound(p.y * kUnit)};
}

std::string millimetres(double metres, int digits) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f mm", digits, 1e3 * metres);
  return text.data();
}

class Canvas {
 public:
  Canvas(cv::Mat3b& image, const CameraModel& camera, const Scene& scene, const Annotation& annotation)
      : image_{image}, camera_{camera}, scene_{scene}, annotation_{annotation} {}

  void draw() {
    const bool has_stroke = annotation_.stroke && annotation_.stroke->kind != StrokeKind::kPark;
    workspace();
    for (const auto& disc : scene_.discs) outline(disc);
    if (has_stroke) swept_area();
    predictions();
    for (const auto& contact : scene_.contacts) push_axis(contact);
    gaps();
    if (has_stroke) stroke(*annotation_.stroke);
    for (const auto& disc : scene_.discs) name(disc);
    for (const auto& object : scene_.foreign) foreign(object);
  }

 private:
  cv::Point2d pixel(const Vector2& p_W, double height) const {
    const auto p = camera_.project({p_W.x(), p_W.y(), height});
    if (!p) return {-1e4, -1e4};
    return {std::clamp(p->x(), -1e4, 1e4), std::clamp(p->y(), -1e4, 1e4)};
  }
  cv::Point2d on_top(const Vector2& p_W) const { return pixel(p_W, annotation_.disc_height); }

  void foreign(const ForeignObject& object) {
    circle(object.p_W, object.extent, object.height, kRed, 3, true);
    const cv::Point2d middle = pixel(object.p_W, object.height);
    const std::string what = object.kind == ForeignObject::Kind::kPaint      ? "no disc"
                             : object.kind == ForeignObject::Kind::kOffTable ? "off the table"
                                                                             : "foreign";
    label(object.height > 0.0 ? what + ", " + millimetres(object.height, 0) + " high" : what, middle, {0.0, 1.0}, 0.5, kRed);
  }

  // A line with a dark seam, so that it reads on any background.
  void line(const cv::Point2d& a, const cv::Point2d& b, const cv::Scalar& colour, int width) {
    cv::line(image_, fine(a), fine(b), kInk, width + 2, cv::LINE_AA, kFraction);
    cv::line(image_, fine(a), fine(b), colour, width, cv::LINE_AA, kFraction);
  }

  void arrow(const cv::Point2d& from, const cv::Point2d& to, const cv::Scalar& colour, int width, double head) {
    const cv::Point2d along = to - from;
    const double length = std::hypot(along.x, along.y);
    if (length < 1.0) return;
    const cv::Point2d unit = along / length;
    const cv::Point2d side{-unit.y, unit.x};
    head = std::min(head, 0.6 * length);
    const cv::Point2d neck = to - head * unit;
    line(from, neck, colour, width);
    const std::vector<cv::Point> tip{fine(to), fine(neck + 0.55 * head * side), fine(neck - 0.55 * head * side)};
    cv::polylines(image_, tip, true, kInk, 2, cv::LINE_AA, kFraction);
    cv::fillConvexPoly(image_, tip, colour, cv::LINE_AA, kFraction);
  }

  void circle(const Vector2& p_W, double radius, double height, const cv::Scalar& colour, int width, bool dashed) {
    constexpr int kCorners = 96;
    constexpr int kDash = 4;  // corners per dash and per blank
    std::vector<cv::Point> run;
    for (int k = 0; k <= kCorners; ++k) {
      const double angle = 2.0 * CV_PI * k / kCorners;
      run.push_back(fine(pixel(p_W + radius * Vector2{std::cos(angle), std::sin(angle)}, height)));
      const bool ends = dashed ? (k % kDash == 0 && k > 0) : k == kCorners;
      if (!ends) continue;
      if (!dashed || (k / kDash) % 2 == 1) {
        if (!dashed) cv::polylines(image_, run, false, kInk, width + 2, cv::LINE_AA, kFraction);
        cv::polylines(image_, run, false, colour, width, cv::LINE_AA, kFraction);
      }
      run.assign(1, run.back());
    }
  }

  // A text on a dark label beside a place: `away` (a direction in the image) says on which side.
  void label(const std::string& text, const cv::Point2d& place, const cv::Point2d& away, double size, const cv::Scalar& colour) {
    constexpr int kPad = 4;
    int below = 0;
    const cv::Size extent = cv::getTextSize(text, kFont, size, 1, &below);
    const double length = std::max(1e-9, std::hypot(away.x, away.y));
    const double reach = 8.0 + kPad + (std::abs(away.x) * extent.width + std::abs(away.y) * extent.height) / (2.0 * length);
    const cv::Point2d at = place + away * (reach / length);
    cv::Point corner{cvRound(at.x - extent.width / 2.0), cvRound(at.y + extent.height / 2.0)};
    corner.x = std::clamp(corner.x, kPad, std::max(kPad, image_.cols - extent.width - kPad));
    corner.y = std::clamp(corner.y, extent.height + kPad, std::max(extent.height + kPad, image_.rows - kPad));
    const cv::Rect box{corner.x - kPad, corner.y - extent.height - kPad, extent.width + 2 * kPad, extent.height + 2 * kPad};
    const cv::Rect visible = box & cv::Rect{{0, 0}, image_.size()};
    if (!visible.empty()) {
      cv::Mat part = image_(visible);
      cv::addWeighted(part, 0.25, cv::Mat(part.size(), part.type(), kInk), 0.75, 0.0, part);
    }
    cv::putText(image_, text, corner, kFont, size, colour, 1, cv::LINE_AA);
  }

  void workspace() {
    const Rect& w = annotation_.workspace;
    const std::array<Vector2, 4> corners{w.min, Vector2{w.max.x(), w.min.y()}, w.max, Vector2{w.min.x(), w.max.y()}};
    constexpr int kDashes = 40;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector2 a = corners[i];
      const Vector2 b = corners[(i + 1) % 4];
      for (int k = 0; k < kDashes; k += 2) {
        const Vector2 from = a + (b - a) * (static_cast<double>(k) / kDashes);
        const Vector2 to = a + (b - a) * ((k + 1.0) / kDashes);
        cv::line(image_, fine(pixel(from, 0.0)), fine(pixel(to, 0.0)), kInk, 1, cv::LINE_AA, kFraction);
      }
    }
  }

  void outline(const SceneDisc& disc) { circle(disc.p_WD, disc.radius, annotation_.disc_height, kWhite, 1, !disc.complete); }

  void name(const SceneDisc& disc) {
    const std::string text = std::to_string(disc.id);
    int below = 0;
    const cv::Size extent = cv::getTextSize(text, kFont, 0.55, 1, &below);
    const cv::Point2d at = on_top(disc.p_WD);
    const cv::Point corner{cvRound(at.x - extent.width / 2.0), cvRound(at.y + extent.height / 2.0)};
    cv::circle(image_, fine(at), cvRound((1 << kFraction) * (0.5 * std::hypot(extent.width, extent.height) + 4.0)), kInk, cv::FILLED,
               cv::LINE_AA, kFraction);
    cv::putText(image_, text, corner, kFont, 0.55, kWhite, 1, cv::LINE_AA);
  }

  void push_axis(const SceneContact& contact) {
    // Thin and without a seam: a rack has many, and the stroke that was chosen must stand out.
    const Vector2 to = contact.push_start_W + contact.contour_length * contact.push_direction_W;
    cv::line(image_, fine(on_top(contact.push_start_W)), fine(on_top(to)), kWhite, 1, cv::LINE_AA, kFraction);
    const Vector2 side = 0.004 * perpendicular(contact.push_direction_W);
    const Vector2 neck = to - 0.007 * contact.push_direction_W;
    const std::vector<cv::Point> tip{fine(on_top(to)), fine(on_top(neck + side)), fine(on_top(neck - side))};
    cv::fillConvexPoly(image_, tip, kWhite, cv::LINE_AA, kFraction);
  }

  // Gaps of touching pairs and of pairs nearer than G; for a disc that has none of these, the gap to its nearest neighbour.
  void gaps() {
    const auto& discs = scene_.discs;
    const auto gap_of = [&](std::size_t a, std::size_t b) {
      return (discs[a].p_WD - discs[b].p_WD).norm() - discs[a].radius - discs[b].radius;
    };
    for (std::size_t a = 0; a < discs.size(); ++a) {
      for (std::size_t b = a + 1; b < discs.size(); ++b) {
        const double gap = gap_of(a, b);
        if (gap < annotation_.target_gap || (nearest(a) == b && nearest(b) == a)) gap_mark(discs[a], discs[b], gap);
      }
    }
  }

  std::size_t nearest(std::size_t of) const {
    const auto& discs = scene_.discs;
    std::size_t best = of;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < discs.size(); ++i) {
      if (i == of) continue;
      const double gap = (discs[i].p_WD - discs[of].p_WD).norm() - discs[i].radius - discs[of].radius;
      if (gap < least) {
        least = gap;
        best = i;
      }
    }
    return best;
  }

  void gap_mark(const SceneDisc& a, const SceneDisc& b, double gap) {
    const Vector2 n_AB = (b.p_WD - a.p_WD).normalized();
    const cv::Point2d from = on_top(a.p_WD + a.radius * n_AB);
    const cv::Point2d to = on_top(b.p_WD - b.radius * n_AB);
    if (gap < kTouchDrawn) {
      const cv::Point2d middle = (from + to) / 2.0;
      cv::circle(image_, fine(middle), 5 << kFraction, kInk, cv::FILLED, cv::LINE_AA, kFraction);
      cv::circle(image_, fine(middle), 3 << kFraction, kRed, cv::FILLED, cv::LINE_AA, kFraction);
      return;
    }
    const cv::Scalar& colour = gap < annotation_.target_gap ? kAmber : kGreen;
    line(from, to, colour, 2);
    // Beside the gap, on the side that is farther to the right in the image.
    const cv::Point2d side{-(to - from).y, (to - from).x};
    label(millimetres(gap, 1), (from + to) / 2.0, side.x < 0.0 ? -side : side, 0.4, colour);
  }

  void predictions() {
    const std::size_t n = std::min(annotation_.predicted_p_WD.size(), scene_.discs.size());
    for (std::size_t i = 0; i < n; ++i) {
      const SceneDisc& disc = scene_.discs[i];
      const Vector2& to = annotation_.predicted_p_WD[i];
      if ((to - disc.p_WD).norm() < 0.003) continue;  // stays where it is
      cv::line(image_, fine(on_top(disc.p_WD)), fine(on_top(to)), kBlue, 1, cv::LINE_AA, kFraction);
      circle(to, disc.radius, annotation_.disc_height, kBlue, 2, true);
    }
  }

  // The striker's way, as wide as the striker.
  void swept_area() {
    const StrokeRequest& s = *annotation_.stroke;
    const Vector2 from = s.kind == StrokeKind::kHit ? Vector2{s.p_WS - s.run_in * s.direction_W} : s.p_WS;
    const Vector2 to = s.kind == StrokeKind::kHit ? s.p_WS : Vector2{s.p_WS + s.length * s.direction_W};
    const double facing = std::atan2(s.direction_W.y(), s.direction_W.x());
    std::vector<cv::Point> shape;
    constexpr int kCorners = 16;
    for (const auto& [end, turn] : {std::pair{to, -0.5}, std::pair{from, 0.5}}) {
      for (int k = 0; k <= kCorners; ++k) {
        const double angle = facing + CV_PI * (turn + static_cast<double>(k) / kCorners);
        shape.push_back(fine(on_top(end + annotation_.striker_radius * Vector2{std::cos(angle), std::sin(angle)})));
      }
    }
    cv::Mat3b over = image_.clone();
    cv::fillConvexPoly(over, shape, kGreen, cv::LINE_AA, kFraction);
    cv::addWeighted(over, 0.35, image_, 0.65, 0.0, image_);
    cv::polylines(image_, shape, true, kGreen, 1, cv::LINE_AA, kFraction);
  }

  void stroke(const StrokeRequest& s) {
    const bool hit = s.kind == StrokeKind::kHit;
    const Vector2 from = hit ? Vector2{s.p_WS - s.run_in * s.direction_W} : s.p_WS;
    const Vector2 to = hit ? Vector2{s.p_WS + annotation_.striker_radius * s.direction_W} : Vector2{s.p_WS + s.length * s.direction_W};
    arrow(on_top(from), on_top(to), kGreen, 3, 16.0);
    std::array<char, 64> text{};
    if (hit) {
      std::snprintf(text.data(), text.size(), "hit %.2f m/s", s.speed);
    } else {
      std::snprintf(text.data(), text.size(), "push %.0f mm", 1e3 * s.length);
    }
    label(text.data(), on_top(from - annotation_.striker_radius * s.direction_W), on_top(from) - on_top(from + s.direction_W), 0.5, kGreen);
  }

  cv::Mat3b& image_;
  const CameraModel& camera_;
  const Scene& scene_;
  const Annotation& annotation_;
};

}  // namespace

ColorFrame annotate(const ColorFrame& image, const Scene& scene, const CameraModel& camera, const Annotation& annotation) {
  const auto bytes = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height) * 3;
  if (image.width != camera.width || image.height != camera.height || image.rgb.size() != bytes) {
    throw std::invalid_argument("annotate: found an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                                " px; the camera has " + std::to_string(camera.width) + " x " + std::to_string(camera.height));
  }
  const int banner = annotation.headline.empty() ? 0 : annotation.detail.empty() ? 42 : 66;
  ColorFrame out{image.seq, image.exposed, image.width, image.height + banner, {}};
  out.rgb.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * 3);
  cv::Mat3b pixels(out.height, out.width, reinterpret_cast<cv::Vec3b*>(out.rgb.data()));
  cv::Mat3b picture = pixels.rowRange(banner, out.height);
  std::copy(image.rgb.begin(), image.rgb.end(), picture.data);
  Canvas{picture, camera, scene, annotation}.draw();
  if (banner > 0) {
    pixels.rowRange(0, banner).setTo(kInk);
    cv::putText(pixels, annotation.headline, {16, 28}, kFont, 0.7, kWhite, 1, cv::LINE_AA);
    cv::putText(pixels, annotation.detail, {16, 54}, kFont, 0.5, kPale, 1, cv::LINE_AA);
  }
  return out;
}

}  // namespace breakshot::perception
