#include "perception/camera_watch.hpp"

#include "perception/least_squares.hpp"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace breakshot::perception {
namespace {

constexpr double kCornerSigma =
    0.12;                       // px, of a marker's corner: noise, shading and what the print's edge is taken for (camera_watch_test)
constexpr double kHuber = 3.0;  // sigmas: a corner in an odd shadow does not pull the others along
// How far a camera may have moved, as far as nobody has looked: m, rad. Only makes the fit determinate when few markers are in view.
constexpr double kMoveSigma = 0.02, kTurnSigma = 0.035;
/// A verdict needs shifts that are known this much better than the one that is allowed.
constexpr double kSigmas = 4.0;
constexpr double kReach = 0.7;      // of a marker's size in the image: how far around its place it is looked for ...
constexpr double kLeastReach = 40;  // px: ... at least
constexpr double kMargin = 1.34;    // the white margin of a marker, in its black squares
constexpr int kUnseenLooks = 4;     // in a row, before it is said that no marker is seen

Vector2 to_vector(const cv::Point2f& p) { return {p.x, p.y}; }

bool inside(const CameraModel& camera, const Vector2& pixel) {
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= camera.width - 1.0 && pixel.y() <= camera.height - 1.0;
}

}  // namespace

CameraWatch::CameraWatch(const CameraModel& camera, const CameraWatchSettings& settings, const ArmMask& arm)
    : camera_{camera},
      settings_{settings},
      arm_{arm},
      dictionary_{cv::aruco::getPredefinedDictionary(static_cast<int>(settings.markers.dictionary))},
      parameters_{cv::aruco::DetectorParameters::create()} {
  double smallest = 1e9;  // px, of a marker's side
  for (const TableMarker& marker : settings.markers.at) {
    Watched watched{marker, corners_of(marker, settings.markers.side), {}, {}};
    bool in_view = true;
    for (const Vector2& corner : corners_of(marker, kMargin * settings.markers.side)) {
      const auto pixel = camera.project({corner.x(), corner.y(), 0.0});
      in_view = in_view && pixel && inside(camera, *pixel);
    }
    if (!in_view) continue;
    Vector2 low = Vector2::Constant(1e9), high = Vector2::Constant(-1e9);
    for (std::size_t i = 0; i < 4; ++i) {
      watched.corners_px[i] = *camera.project({watched.corners_W[i].x(), watched.corners_W[i].y(), 0.0});
      low = low.cwiseMin(watched.corners_px[i]);
      high = high.cwiseMax(watched.corners_px[i]);
    }
    const double size = (high - low).maxCoeff();
    const double reach = std::max(kLeastReach, kReach * size);
    const cv::Rect box{cv::Point(static_cast<int>(low.x() - reach), static_cast<int>(low.y() - reach)),
                       cv::Point(static_cast<int>(high.x() + reach), static_cast<int>(high.y() + reach))};
    watched.near = box & cv::Rect{0, 0, camera.width, camera.height};
    for (std::size_t i = 0; i < 4; ++i) smallest = std::min(smallest, (watched.corners_px[i] - watched.corners_px[(i + 1) % 4]).norm());
    watched_.push_back(watched);
  }
  // The window in which a corner is refined must not reach the next square of the code.
  const double square = smallest / (dictionary_->markerSize + 2);
  parameters_->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  parameters_->cornerRefinementWinSize = std::clamp(static_cast<int>(0.45 * square), 2, 5);
}

bool CameraWatch::hidden(const Watched& watched) const noexcept {
  for (const double scale : {0.0, 1.0, kMargin}) {
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector2 centre = 0.5 * (watched.corners_px[0] + watched.corners_px[2]);
      const Vector2 corner = watched.corners_px[i], next = watched.corners_px[(i + 1) % 4];
      if (arm_.covers(centre + scale * (corner - centre)) || arm_.covers(centre + scale * (0.5 * (corner + next) - centre))) return true;
    }
  }
  return false;
}

void CameraWatch::find(const cv::Mat3b& rgb, const cv::Rect& where, std::vector<Sighting>& sightings) const {
  cv::Mat grey;
  cv::cvtColor(rgb(where), grey, cv::COLOR_RGB2GRAY);
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, dictionary_, corners, ids, parameters_);
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const auto watched = std::find_if(watched_.begin(), watched_.end(), [&](const Watched& w) { return w.marker.id == ids[k]; });
    const bool twice = std::any_of(sightings.begin(), sightings.end(), [&](const Sighting& s) { return s.watched->marker.id == ids[k]; });
    if (watched == watched_.end() || twice) continue;
    Sighting sighting{&*watched, {}};
    for (std::size_t i = 0; i < 4; ++i) sighting.corners_px[i] = to_vector(corners[k][i]) + Vector2{where.x, where.y};
    sightings.push_back(sighting);
  }
}

CameraCheck CameraWatch::look(const cv::Mat3b& rgb, bool everywhere) const {
  CameraCheck check;
  std::vector<Sighting> sightings;
  for (const Watched& watched : watched_) {
    if (hidden(watched)) continue;
    ++check.expected;
    if (!everywhere) find(rgb, watched.near, sightings);
  }
  if (check.expected > 0 && everywhere) find(rgb, {{0, 0}, rgb.size()}, sightings);
  check.seen = static_cast<int>(sightings.size());
  if (check.expected > 0 && check.seen == 0) check.verdict = CameraCheck::Verdict::kUnseen;
  if (check.seen > 0) judge(sightings, check);
  return check;
}

void CameraWatch::judge(const std::vector<Sighting>& sightings, CameraCheck& check) const {
  CameraModel there = camera_;
  const auto residuals = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r) {
    there.X_WC = nearby(camera_.X_WC, x);
    Eigen::Index row = 0;
    for (const Sighting& sighting : sightings) {
      for (std::size_t i = 0; i < 4; ++i, row += 2) {
        const Vector2& p_W = sighting.watched->corners_W[i];
        const auto pixel = there.project({p_W.x(), p_W.y(), 0.0});
        r.segment<2>(row) = pixel ? Vector2{(*pixel - sighting.corners_px[i]) / kCornerSigma} : Vector2::Constant(1e6);
      }
    }
    r.segment<3>(row) = x.head<3>() / kTurnSigma;
    r.segment<3>(row + 3) = x.tail<3>() / kMoveSigma;
  };
  const auto count = static_cast<Eigen::Index>(8 * sightings.size() + 6);
  const LeastSquaresFit fit = least_squares(residuals, Eigen::VectorXd::Zero(6), count, kHuber);
  check.turned = fit.x.head<3>().norm();
  check.moved = fit.x.tail<3>().norm();

  // Where perception would put what lies at p_W.
  const auto seen_at = [&](const Vector2& p_W, const Eigen::VectorXd& x) -> Vector2 {
    there.X_WC = nearby(camera_.X_WC, x);
    const auto pixel = there.project({p_W.x(), p_W.y(), 0.0});
    return pixel ? camera_.point_on_plane(*pixel, 0.0) : Vector2::Constant(1e3);
  };
  const auto consider = [&](const Vector2& p_W) {
    constexpr double kStep = 1e-6;
    const Vector2 here = seen_at(p_W, fit.x);
    Eigen::Matrix<double, 2, 6> slope;
    for (Eigen::Index k = 0; k < 6; ++k) slope.col(k) = (seen_at(p_W, fit.x + kStep * Eigen::VectorXd::Unit(6, k)) - here) / kStep;
    const double sigma = std::sqrt((slope * fit.inverse * slope.transpose()).trace());
    if (!(kSigmas * sigma <= settings_.max_shift)) return;
    check.shift = std::max(check.shift, (here - p_W).norm());
    check.verdict = check.shift > settings_.max_shift ? CameraCheck::Verdict::kMoved : CameraCheck::Verdict::kInPlace;
  };
  for (const double u : {0.0, 0.5, 1.0}) {
    for (const double v : {0.0, 0.5, 1.0}) {
      consider(settings_.workspace.min + Vector2{u, v}.cwiseProduct(settings_.workspace.max - settings_.workspace.min));
    }
  }
  for (const Sighting& sighting : sightings) consider(sighting.watched->marker.p_WM);
}

const std::optional<std::string>& CameraWatch::on_frame(const cv::Mat3b& rgb, Time exposed, bool now) {
  // Stamps that go back are a camera that was started anew.
  const bool due = now || !looked_ || doubtful_ || exposed < *looked_ || exposed - *looked_ >= settings_.period;
  if (watched_.empty() || !due) return alarm_;
  looked_ = exposed;
  CameraCheck check = look(rgb);
  unseen_ = check.verdict == CameraCheck::Verdict::kUnseen ? unseen_ + 1 : 0;
  if (unseen_ >= kUnseenLooks) {
    // Covered, or so far away that they are not looked for there?
    if (const CameraCheck wide = look(rgb, true); wide.seen > 0) check = wide;
  }
  last_ = check;
  const bool was_doubtful = std::exchange(doubtful_, false);
  switch (check.verdict) {
    case CameraCheck::Verdict::kNothing: break;
    case CameraCheck::Verdict::kInPlace:
      doubtful_ = alarm_ && !was_doubtful;
      if (!doubtful_) alarm_.reset();
      break;
    case CameraCheck::Verdict::kMoved:
      doubtful_ = !alarm_ && !was_doubtful;
      if (!doubtful_) alarm_ = describe(check, settings_.max_shift);
      break;
    case CameraCheck::Verdict::kUnseen:
      if (unseen_ >= kUnseenLooks) alarm_ = describe(check, settings_.max_shift);
      break;
  }
  return alarm_;
}

}  // namespace breakshot::perception
