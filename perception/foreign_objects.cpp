#include "perception/foreign_objects.hpp"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace breakshot::perception {
namespace {

constexpr int kGlance = 4;           // px between depth samples
constexpr int kBlock = 16;           // px: side of a block, whose height is the mean of 16 samples: 0.6 mm rms
constexpr int kLeastSamples = 6;     // of a block or a top face that have a depth
constexpr int kLeastBlocks = 2;      // of an object: 14 mm x 28 mm
constexpr double kStandsUp = 8e-3;   // m above the table
constexpr double kOffPlane = 7e-3;   // m between a top face and where it should be
constexpr double kMargin = 4e-3;     // m around a disc's silhouette: depth bleeds over edges, colour over a pixel
constexpr double kFullArea = 1.10;   // of the silhouettes: a patch that is no larger holds nothing else
constexpr int kCorners = 48;         // of the polygon that stands for a rim
constexpr double kInnerShare = 0.7;  // of the radius: where depth is that of the top face alone
constexpr int kExcusedPoints = 8;    // of an outline on the border or in the arm: the patch is cut there
constexpr double kBaseReach = 0.12;  // m from the middle of the arm's base: what stands there is the arm

}  // namespace

ForeignObjects::ForeignObjects(const View& view, const PerceptionSettings& settings, const ArmMask& arm)
    : view_{view}, settings_{settings}, arm_{arm} {
  const CameraModel& camera = view.camera;
  for (int y = kGlance / 2; y < camera.height; y += kGlance) {
    for (int x = kGlance / 2; x < camera.width; x += kGlance) {
      const Vector2 p_W = camera.point_on_plane({x, y}, 0.0);
      const Vector3 way_C = camera.X_WC.inverse() * Vector3{p_W.x(), p_W.y(), 0.0};
      slope_.push_back(static_cast<float>(-camera.X_WC.translation().z() / way_C.z()));
    }
  }
}

std::vector<ForeignObject> ForeignObjects::find(std::span<const Region> regions, std::span<const DiscFit> discs, const DepthFrame* depth,
                                                ArmKnown known) {
  std::vector<ForeignObject> out;
  table_height_ = 0.0;
  shown_.release();
  if (depth != nullptr) find_blocks(*depth);
  if (known == ArmKnown::kNo && !find_arm()) return out;
  if (depth != nullptr) find_heights(discs, *depth, out);
  find_paint(regions, discs, out);
  if (out.size() > kMaxSceneForeign) out.resize(kMaxSceneForeign);
  return out;
}

std::vector<cv::Point> ForeignObjects::silhouette(const DiscFit& disc, double margin) const {
  std::vector<cv::Point> points, hull;
  for (int k = 0; k < kCorners; ++k) {
    const double angle = 2.0 * CV_PI * k / kCorners;
    const Vector2 p = disc.p_WD + (disc.radius + margin) * Vector2{std::cos(angle), std::sin(angle)};
    for (const double z : {0.0, view_.disc_height}) {
      if (const auto pixel = view_.camera.project({p.x(), p.y(), z})) points.emplace_back(cvRound(pixel->x()), cvRound(pixel->y()));
    }
  }
  cv::convexHull(points, hull);
  return hull;
}

// Whether the image's border or the arm cuts a patch, so that it may be part of a disc.
bool ForeignObjects::cut(const Region& region) const {
  int points = 0;
  for (const cv::Point& p : region.outlines.front().points) {
    const bool border = p.x <= 2 || p.y <= 2 || p.x >= view_.camera.width - 3 || p.y >= view_.camera.height - 3;
    bool arm = false;  // beside the pixel: the arm itself is not of the patch
    for (const cv::Point& step : {cv::Point{3, 0}, cv::Point{-3, 0}, cv::Point{0, 3}, cv::Point{0, -3}}) {
      arm = arm || behind_arm(p + step);
    }
    points += border || arm ? 1 : 0;
  }
  return points >= kExcusedPoints;
}

void ForeignObjects::find_paint(std::span<const Region> regions, std::span<const DiscFit> discs, std::vector<ForeignObject>& out) {
  const double pixels_per_metre = view_.camera.fx / (view_.camera.X_WC.translation().z() - view_.disc_height);
  const double smallest_px = CV_PI * std::pow(settings_.radius_min * pixels_per_metre, 2);
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const Region& region = regions[i];
    double discs_px = 0.0;
    for (const DiscFit& disc : discs) {
      if (disc.region == i) discs_px += cv::contourArea(silhouette(disc, 0.0));
    }
    if (region.area_px < kFullArea * discs_px + 0.25 * smallest_px) continue;
    // What is left of the patch without the discs of its colour, and without strips along their rims. The arm may cut one disc into two patches.
    region.mask.copyTo(left_);
    for (const DiscFit& disc : discs) {
      if (disc.colour != region.colour) continue;
      std::vector<cv::Point> hull = silhouette(disc, kMargin);
      for (cv::Point& p : hull) p -= region.box.tl();
      cv::fillConvexPoly(left_, hull, 0);
    }
    cv::erode(left_, left_, cv::Mat(), {-1, -1}, 3, cv::BORDER_CONSTANT, 0);
    cv::Mat stats, centroids;
    const int found = cv::connectedComponentsWithStats(left_, components_, stats, centroids, 8);
    for (int k = 1; k < found; ++k) {
      if (stats.at<int>(k, cv::CC_STAT_AREA) < 0.15 * smallest_px) continue;
      const double width = stats.at<int>(k, cv::CC_STAT_WIDTH) + 6.0, height_px = stats.at<int>(k, cv::CC_STAT_HEIGHT) + 6.0;
      const bool no_larger = std::max(width, height_px) < 2.2 * settings_.radius_max * pixels_per_metre;
      if (no_larger && cut(region)) continue;
      ForeignObject object;
      object.kind = ForeignObject::Kind::kPaint;
      object.p_W = place({region.box.x + centroids.at<double>(k, 0), region.box.y + centroids.at<double>(k, 1)}, view_.disc_height);
      object.extent = 0.5 * std::hypot(width, height_px) / pixels_per_metre;
      const bool known = std::any_of(out.begin(), out.end(), [&](const ForeignObject& other) {
        return (other.p_W - object.p_W).norm() < other.extent + object.extent;
      });
      if (!known) out.push_back(object);
    }
  }
}

double ForeignObjects::height(const DepthFrame& depth, int x, int y) const noexcept {
  const std::uint16_t range =
      depth.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(depth.width) + static_cast<std::size_t>(x)];
  const int columns = (view_.camera.width - kGlance / 2 + kGlance - 1) / kGlance;
  const float slope = slope_[static_cast<std::size_t>(y / kGlance * columns + x / kGlance)];
  if (range == 0) return std::numeric_limits<double>::quiet_NaN();
  return view_.camera.X_WC.translation().z() + 1e-4 * range * static_cast<double>(slope);
}

// Above the table of the depth image; NaN when there is too little depth.
double ForeignObjects::height_of_top(const DiscFit& disc, const DepthFrame& depth) const {
  const auto middle = view_.camera.project({disc.p_WD.x(), disc.p_WD.y(), view_.disc_height});
  const auto rim = view_.camera.project({disc.p_WD.x() + kInnerShare * disc.radius, disc.p_WD.y(), view_.disc_height});
  if (!middle || !rim) return std::numeric_limits<double>::quiet_NaN();
  const double reach = (*rim - *middle).norm();
  double sum = 0.0;
  int samples = 0;
  const auto first = [](double from) { return static_cast<int>(std::max(0.0, from)) / kGlance * kGlance + kGlance / 2; };
  for (int y = first(middle->y() - reach); y < std::min<double>(depth.height, middle->y() + reach); y += kGlance) {
    for (int x = first(middle->x() - reach); x < std::min<double>(depth.width, middle->x() + reach); x += kGlance) {
      if ((Vector2{x, y} - *middle).norm() > reach || behind_arm({x, y})) continue;
      const double z = height(depth, x, y);
      if (std::isnan(z)) continue;
      sum += z;
      ++samples;
    }
  }
  return samples < kLeastSamples ? std::numeric_limits<double>::quiet_NaN() : sum / samples - table_height_;
}

bool ForeignObjects::behind_arm(const cv::Point& pixel) const noexcept {
  if (arm_.covers({pixel.x, pixel.y})) return true;
  const int column = pixel.x / kBlock, row = pixel.y / kBlock;
  return pixel.x >= 0 && pixel.y >= 0 && column < shown_.cols && row < shown_.rows && shown_(row, column) == kArm;
}

// What depth says of all blocks, and which of them the arm is known to hide.
void ForeignObjects::find_blocks(const DepthFrame& depth) {
  const int columns = depth.width / kBlock, rows = depth.height / kBlock;
  mean_.create(rows, columns);
  shown_.create(rows, columns);
  shown_ = std::uint8_t{kTable};
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      double sum = 0.0;
      int samples = 0;
      for (int y = row * kBlock + kGlance / 2; y < (row + 1) * kBlock; y += kGlance) {
        for (int x = column * kBlock + kGlance / 2; x < (column + 1) * kBlock; x += kGlance) {
          const double z = height(depth, x, y);
          if (std::isnan(z)) continue;
          sum += z;
          ++samples;
        }
      }
      mean_(row, column) = samples < kLeastSamples ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(sum / samples);
      for (const int k : {0, kBlock / 2, kBlock - 1}) {
        for (const int m : {0, kBlock / 2, kBlock - 1}) {
          if (arm_.covers({column * kBlock + k, row * kBlock + m})) shown_(row, column) = kArm;
        }
      }
    }
  }
  widen_arm();
  measure_table();
}

// The median of all blocks that nothing is known to stand on.
void ForeignObjects::measure_table() {
  heights_.clear();
  for (int row = 0; row < shown_.rows; ++row) {
    for (int column = 0; column < shown_.cols; ++column) {
      if (shown_(row, column) == kTable && !std::isnan(mean_(row, column))) heights_.push_back(mean_(row, column));
    }
  }
  if (heights_.empty()) return;
  const auto middle = heights_.begin() + static_cast<std::ptrdiff_t>(heights_.size() / 2);
  std::nth_element(heights_.begin(), middle, heights_.end());
  table_height_ = static_cast<double>(*middle);
}

void ForeignObjects::widen_arm() {
  cv::Mat1b arm;
  cv::compare(shown_, kArm, arm, cv::CMP_EQ);
  cv::dilate(arm, arm, cv::Mat());
  shown_.setTo(kArm, arm);
}

// Without the joints the arm is what stands higher than any disc and hangs together with what stands on the place of its base. False when there is
// no such thing in the picture: then nobody can tell the arm from what does not belong there.
bool ForeignObjects::find_arm() {
  if (shown_.empty()) return false;
  tall_.create(shown_.size());
  std::vector<cv::Point> base;
  for (int row = 0; row < shown_.rows; ++row) {
    for (int column = 0; column < shown_.cols; ++column) {
      const double z = static_cast<double>(mean_(row, column)) - table_height_;
      tall_(row, column) = z > view_.disc_height + kOffPlane ? 255 : 0;
      if (tall_(row, column) == 0) continue;
      const Vector2 p_W = place({(column + 0.5) * kBlock, (row + 0.5) * kBlock}, z);
      if ((p_W - settings_.p_WB).norm() < kBaseReach) base.emplace_back(column, row);
    }
  }
  cv::connectedComponents(tall_, components_, 8);
  for (const cv::Point& block : base) shown_.setTo(kArm, components_ == components_(block));
  widen_arm();
  return !base.empty();
}

void ForeignObjects::find_heights(std::span<const DiscFit> discs, const DepthFrame& depth, std::vector<ForeignObject>& out) {
  const int columns = shown_.cols, rows = shown_.rows;
  cv::Mat1b covered(shown_.size(), std::uint8_t{0});
  for (const DiscFit& disc : discs) {
    std::vector<cv::Point> hull = silhouette(disc, kMargin);
    for (cv::Point& p : hull) p = {p.x / kBlock, p.y / kBlock};
    cv::fillConvexPoly(covered, hull, 255);
    for (const cv::Point& p : hull) {
      if (p.inside({{0, 0}, shown_.size()})) covered(p) = 255;
    }
  }
  covered.setTo(0, shown_ == kArm);
  shown_.setTo(kDisc, covered);
  measure_table();

  tall_.create(rows, columns);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      tall_(row, column) = shown_(row, column) == kTable && static_cast<double>(mean_(row, column)) - table_height_ > kStandsUp ? 255 : 0;
    }
  }
  cv::Mat stats, centroids;
  const int found = cv::connectedComponentsWithStats(tall_, components_, stats, centroids, 8);
  for (int k = 1; k < found; ++k) {
    if (stats.at<int>(k, cv::CC_STAT_AREA) < kLeastBlocks) continue;
    ForeignObject object;
    object.kind = ForeignObject::Kind::kHeight;
    bool excusable = false;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        if (components_(row, column) != k) continue;
        object.height = std::max(object.height, static_cast<double>(mean_(row, column)) - table_height_);
        excusable = excusable || row == 0 || column == 0 || row == rows - 1 || column == columns - 1;
        for (int y = std::max(0, row - 1); y <= std::min(rows - 1, row + 1); ++y) {
          for (int x = std::max(0, column - 1); x <= std::min(columns - 1, column + 1); ++x) excusable = excusable || shown_(y, x) == kArm;
        }
      }
    }
    if (excusable && object.height < view_.disc_height + kOffPlane) continue;
    const Vector2 pixel{(centroids.at<double>(k, 0) + 0.5) * kBlock, (centroids.at<double>(k, 1) + 0.5) * kBlock};
    object.p_W = place(pixel, object.height);
    const double pixels_per_metre = view_.camera.fx / (view_.camera.X_WC.translation().z() - object.height);
    object.extent = 0.5 * kBlock * std::hypot(stats.at<int>(k, cv::CC_STAT_WIDTH), stats.at<int>(k, cv::CC_STAT_HEIGHT)) / pixels_per_metre;
    out.push_back(object);
  }

  for (const DiscFit& disc : discs) {
    const double z = height_of_top(disc, depth);
    if (std::isnan(z) || std::abs(z - view_.disc_height) < kOffPlane) continue;
    out.push_back({ForeignObject::Kind::kOffTable, disc.p_WD, disc.radius, z});
  }
}

}  // namespace breakshot::perception
