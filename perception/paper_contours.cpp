#include "perception/paper_contours.hpp"

#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace breakshot::perception {
namespace {

constexpr int kCorners = 72;      // of the polygon that stands for a rim: its chords stay within 0.03 px of the arc
constexpr int kFractionBits = 4;  // cv::fillPoly takes coordinates in 1/16 px

// The rim of a disc as the camera sees it, px.
void append_rim(const View& view, const Vector2& p_WD, double radius, double height, std::vector<cv::Point2f>& out) {
  for (int k = 0; k < kCorners; ++k) {
    const double angle = 2.0 * CV_PI * k / kCorners;
    const Vector2 p = p_WD + radius * Vector2{std::cos(angle), std::sin(angle)};
    if (const auto pixel = view.camera.project({p.x(), p.y(), height})) {
      out.emplace_back(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
    }
  }
}

}  // namespace

std::vector<DiscFit> paper_discs(const View& view, const PerceptionSettings& settings, std::span<const Region> regions) {
  std::vector<DiscFit> discs;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const Region& region = regions[i];
    if (region.colour == kNoColour) continue;
    const cv::Moments moments = cv::moments(region.mask, true);
    const Vector2 middle{region.box.x + moments.m10 / moments.m00, region.box.y + moments.m01 / moments.m00};
    DiscFit disc;
    disc.p_WD = view.camera.point_on_plane(middle, view.disc_height);
    const double pixel = (view.camera.point_on_plane(middle + Vector2{1.0, 0.0}, view.disc_height) - disc.p_WD).norm();
    disc.radius = pixel * std::sqrt(moments.m00 / CV_PI);
    if (disc.radius < settings.radius_min || disc.radius > settings.radius_max) continue;
    disc.covariance = pixel * pixel * Matrix3::Identity();
    disc.seen_share = 1.0;
    disc.complete = true;
    disc.colour = region.colour;
    disc.region = i;
    discs.push_back(disc);
  }
  return discs;
}

PaperContours::PaperContours(const View& view, const PerceptionSettings& settings) : view_{view}, settings_{settings} {}

const std::vector<ContourContact>& PaperContours::find(std::span<const Region> regions, std::span<const DiscFit> discs) {
  contacts_.clear();
  thick_.resize(discs.size());
  for (std::size_t i = 0; i < discs.size(); ++i) draw(regions[discs[i].region], discs[i], thick_[i]);
  for (std::size_t a = 0; a < discs.size(); ++a) {
    for (std::size_t b = a + 1; b < discs.size(); ++b) {
      ContourContact found;
      if (!contact(thick_[a], thick_[b], found)) continue;
      found.a = a;
      found.b = b;
      contacts_.push_back(found);
    }
  }
  return contacts_;
}

void PaperContours::draw(const Region& region, const DiscFit& disc, ThickContour& out) {
  // The disc's own part of the patch: its top face, or all of its silhouette. Discs of one colour that touch share a patch.
  std::vector<cv::Point2f> rim;
  append_rim(view_, disc.p_WD, disc.radius, view_.disc_height, rim);
  if (!settings_.paper.cut_walls) {
    append_rim(view_, disc.p_WD, disc.radius, 0.0, rim);
    std::vector<cv::Point2f> hull;
    cv::convexHull(rim, hull);
    rim = std::move(hull);
  }
  const int margin = settings_.paper.thickness_px + 1;
  const cv::Rect image{0, 0, view_.camera.width, view_.camera.height};
  const cv::Rect outer = cv::boundingRect(rim);
  out.box = (cv::Rect{outer.x - margin, outer.y - margin, outer.width + 2 * margin, outer.height + 2 * margin}) & image;
  out.drawn.create(out.box.size());
  out.drawn.setTo(0);
  if (out.box.empty()) return;

  std::vector<cv::Point> polygon;
  constexpr float kUnit = 1 << kFractionBits;
  for (const auto& p : rim) {
    polygon.emplace_back(cvRound((p.x - static_cast<float>(out.box.x)) * kUnit), cvRound((p.y - static_cast<float>(out.box.y)) * kUnit));
  }
  clip_.create(out.box.size());
  clip_.setTo(0);
  cv::fillPoly(clip_, std::vector<std::vector<cv::Point>>{polygon}, 255, cv::LINE_8, kFractionBits);
  const cv::Rect common = out.box & region.box;
  cv::Mat1b part(out.box.size(), std::uint8_t{0});
  cv::bitwise_and(clip_(common - out.box.tl()), region.mask(common - region.box.tl()), part(common - out.box.tl()));

  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(part, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  const auto longest = std::max_element(contours.begin(), contours.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  if (longest == contours.end()) return;
  cv::drawContours(out.drawn, std::vector<std::vector<cv::Point>>{*longest}, 0, 255, settings_.paper.thickness_px);
}

bool PaperContours::contact(const ThickContour& a, const ThickContour& b, ContourContact& out) {
  const cv::Rect common = a.box & b.box;
  if (common.empty()) return false;
  cv::bitwise_and(a.drawn(common - a.box.tl()), b.drawn(common - b.box.tl()), both_);
  overlap_.clear();
  if (cv::countNonZero(both_) < settings_.paper.min_overlap_px) return false;
  cv::findNonZero(both_, overlap_);

  Eigen::Matrix2Xd points{2, static_cast<Eigen::Index>(overlap_.size())};
  for (std::size_t i = 0; i < overlap_.size(); ++i) {
    const cv::Point at = overlap_[i] + common.tl();
    points.col(static_cast<Eigen::Index>(i)) = view_.camera.point_on_plane({at.x, at.y}, view_.disc_height);
  }
  const Vector2 middle = points.rowwise().mean();
  points.colwise() -= middle;
  const Eigen::SelfAdjointEigenSolver<Matrix2> principal{Matrix2{points * points.transpose()}};
  Vector2 axis = principal.eigenvectors().col(1);  // eigenvalues come in increasing order
  const Eigen::RowVectorXd along = axis.transpose() * points;
  double near_end = along.minCoeff();
  const double far_end = along.maxCoeff();
  out.contour_length = far_end - near_end;
  const Vector2 ends[] = {middle + near_end * axis, middle + far_end * axis};
  if ((ends[1] - settings_.p_WB).squaredNorm() < (ends[0] - settings_.p_WB).squaredNorm()) {
    axis = -axis;
    near_end = -far_end;
  }
  out.push_start_W = middle + near_end * axis;
  out.push_direction_W = axis;
  return true;
}

}  // namespace breakshot::perception
