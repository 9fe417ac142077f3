#include "perception/calibrate/calibration_checks.hpp"

#include <fmt/core.h>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace breakshot::perception {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr int kLeastCorners = 8;        // of a picture, ...
constexpr double kLeastShare = 0.25;    // ... and of the board's
constexpr double kLeastSpan = 0.25;     // of the image's width and height, for a pose
constexpr double kLeastLensSpan = 0.6;  // ... for a lens, which is known no further than it was looked through
constexpr int kLeastLensViews = 6;
constexpr double kLeastTilt = 25.0;  // deg, between the boards of two pictures, for a lens
constexpr int kLeastArmViews = 6;
constexpr double kLeastArmTurn = 15.0;  // deg, about each of two axes, for a board at the arm
constexpr double kOddOneOut = 4.0;      // times the median residual

template <typename... Values>
CalibrationRefusal refusal(fmt::format_string<Values...> format, Values&&... values) {
  return {fmt::format(format, std::forward<Values>(values)...)};
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Share of the image's width and height that the corners of these views span.
Vector2 span(const std::vector<CalibrationView>& views, const CameraModel& camera, bool free_too) {
  Vector2 low = Vector2::Constant(1e9), high = Vector2::Constant(-1e9);
  for (const CalibrationView& view : views) {
    if (!free_too && view.place == BoardPlace::kFree) continue;
    for (const Vector2& p : view.seen.p_pixel) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  return (high - low).cwiseQuotient(Vector2(camera.width, camera.height));
}

/// The tip's turns between pictures as rotation vectors, deg.
std::vector<Vector3> arm_turns(const std::vector<CalibrationView>& views) {
  std::vector<Vector3> turns;
  const Pose* first = nullptr;
  for (const CalibrationView& view : views) {
    if (view.place != BoardPlace::kArm) continue;
    if (first == nullptr) first = &view.X_WT;
    const Eigen::AngleAxisd turn{Matrix3{first->linear().transpose() * view.X_WT.linear()}};
    turns.emplace_back(kDegrees * turn.angle() * turn.axis());
  }
  return turns;
}

}  // namespace

std::optional<CalibrationRefusal> check_views(const std::vector<CalibrationView>& views, const Board& board, const CameraModel& camera) {
  if (views.empty()) return refusal("found no pictures; needed: at least one");
  const int least = std::max(kLeastCorners, static_cast<int>(std::ceil(kLeastShare * board.corners())));
  bool placed = false;
  for (const CalibrationView& view : views) {
    const int corners = static_cast<int>(view.seen.p_P.size());
    placed = placed || view.place != BoardPlace::kFree;
    if (corners == 0) {
      return refusal(
          "{}: the board was not found ({} of its markers were read); needed: {} of its {} corners. Is it this board, whole in view, sharp "
          "and "
          "evenly lit?",
          view.seen.picture, view.seen.markers, least, board.corners());
    }
    if (corners < least) {
      return refusal("{}: found {} of the board's {} corners; needed: {}", view.seen.picture, corners, board.corners(), least);
    }
    Eigen::Matrix2Xd p(2, corners);
    for (int i = 0; i < corners; ++i) p.col(i) = view.seen.p_P[static_cast<std::size_t>(i)].head<2>();
    p.colwise() -= p.rowwise().mean().eval();
    const double thickness = Eigen::JacobiSVD<Eigen::Matrix2Xd>{p}.singularValues()[1] / std::sqrt(static_cast<double>(corners));
    if (thickness < 0.3 * board.square)
      return refusal("{}: found corners in one row only; needed: corners of several rows and columns", view.seen.picture);
  }
  if (!placed) return refusal("found no picture of a board at a known place; needed: one on the table, or held by the arm");
  const Vector2 seen = span(views, camera, false);
  if (seen.minCoeff() < kLeastSpan) {
    return refusal(
        "found corners over {:.0f} % of the image's width and {:.0f} % of its height; needed: {:.0f} % of both. Take a larger board, or "
        "pictures of it "
        "in several places",
        100.0 * seen.x(), 100.0 * seen.y(), 100.0 * kLeastSpan);
  }
  return std::nullopt;
}

std::optional<CalibrationRefusal> check_arm(const std::vector<CalibrationView>& views) {
  const std::vector<Vector3> turns = arm_turns(views);
  if (!turns.empty()) {
    if (static_cast<int>(turns.size()) < kLeastArmViews) {
      return refusal("found {} pictures of the board at the arm; needed: {}", turns.size(), kLeastArmViews);
    }
    Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(turns.size()));
    for (std::size_t i = 0; i < turns.size(); ++i) all.col(static_cast<Eigen::Index>(i)) = turns[i];
    // Turned about one axis only, the board could sit anywhere along it.
    const Eigen::JacobiSVD<Eigen::Matrix3Xd> svd{all, Eigen::ComputeThinU};
    const double second = (svd.matrixU().col(1).transpose() * all).cwiseAbs().maxCoeff();
    if (second < kLeastArmTurn) {
      return refusal(
          "the pictures are too much alike: the arm turns the board by {:.0f} deg about a second axis; needed: {:.0f} deg about each of "
          "two axes",
          second, kLeastArmTurn);
    }
  }
  return std::nullopt;
}

std::optional<CalibrationRefusal> check_lens(const std::vector<CalibrationView>& views, const Guess& guess) {
  if (static_cast<int>(views.size()) < kLeastLensViews) {
    return refusal("found {} pictures; needed for the lens: {}, of boards that are tilted in different ways", views.size(),
                   kLeastLensViews);
  }
  double tilt = 0.0;
  for (const Pose& a : guess.X_CP) {
    for (const Pose& b : guess.X_CP) {
      tilt = std::max(tilt, kDegrees * std::acos(std::clamp(a.linear().col(2).dot(b.linear().col(2)), -1.0, 1.0)));
    }
  }
  if (tilt < kLeastTilt) {
    return refusal(
        "the pictures are too much alike: no two boards are tilted by more than {:.0f} deg against each other; needed for the lens: {:.0f} "
        "deg. A camera "
        "that sees them all face on cannot tell its focal length from its distance",
        tilt, kLeastTilt);
  }
  const Vector2 seen = span(views, guess.camera, true);
  if (seen.minCoeff() < kLeastLensSpan) {
    return refusal("found corners over {:.0f} % of the image's width and {:.0f} % of its height; needed for the lens: {:.0f} % of both",
                   100.0 * seen.x(), 100.0 * seen.y(), 100.0 * kLeastLensSpan);
  }
  return std::nullopt;
}

std::optional<CalibrationRefusal> check_result(const Calibration& result, const CalibrationSettings& settings) {
  std::vector<double> residuals;
  for (const auto& view : result.views) residuals.push_back(view.residual);
  const auto worst =
      std::max_element(result.views.begin(), result.views.end(), [](const auto& a, const auto& b) { return a.residual < b.residual; });
  const double typical = median(residuals);
  if (result.views.size() >= 3 && worst->residual > kOddOneOut * typical && worst->residual > 0.5 * settings.max_residual) {
    return refusal(
        "{}: found residuals of {:.2f} px RMS where the others have {:.2f} px: its board, or the joints stated for it, are not where the "
        "other pictures put "
        "them",
        worst->picture, worst->residual, typical);
  }
  if (!(result.residual <= settings.max_residual)) {
    return refusal(
        "found residuals of {:.2f} px RMS (worst: {}, {:.2f} px); allowed: {:.2f} px. A pose or a joint is not as stated, the board is "
        "bent or of other "
        "measures, or the lens is another{}",
        result.residual, worst->picture, worst->residual, settings.max_residual, settings.intrinsics ? "" : " (--intrinsics finds it)");
  }
  if (!(result.p_sigma <= settings.max_p_sigma && result.turn_sigma <= settings.max_turn_sigma)) {
    return refusal(
        "the pose is sure to {:.2f} mm and {:.3f} deg (standard deviation) only; needed: {:.2f} mm and {:.3f} deg. Take more pictures, or "
        "a larger board",
        1e3 * result.p_sigma, kDegrees * result.turn_sigma, 1e3 * settings.max_p_sigma, kDegrees * settings.max_turn_sigma);
  }
  if (!(result.lens_sigma <= settings.max_residual)) {
    return refusal(
        "the lens is sure to {:.2f} px (standard deviation) only in a corner of the image; needed: {:.2f} px. Take pictures with the board "
        "there, tilted",
        result.lens_sigma, settings.max_residual);
  }
  return std::nullopt;
}

}  // namespace breakshot::perception
