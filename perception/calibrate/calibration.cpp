#include "perception/calibrate/calibration.hpp"

#include "perception/calibrate/calibration_checks.hpp"
#include "perception/calibrate/initial_guess.hpp"
#include "perception/least_squares.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace breakshot::perception {
namespace {

// What the corners of one picture have in common beyond noise: print, flatness, shading. Pictures of a board that was not moved share it, so that a
// hundred of them are no better than this divided by the root of the corners.
constexpr double kSharedSigma = 0.02;  // px
constexpr double kHuber = 3.0;         // sigmas
constexpr double kFirstSigma = 0.1;    // px, until the residuals tell

/// What is looked for, and where each unknown stands in the vector.
class Unknowns {
 public:
  Unknowns(const std::vector<CalibrationView>& views, const Guess& guess, bool intrinsics) : views_{views}, guess_{guess} {
    for (const CalibrationView& view : views) {
      if (view.place == BoardPlace::kArm) tip_ = 0;
    }
    Eigen::Index next = 6;
    if (tip_ == 0) tip_ = std::exchange(next, next + 6);
    if (intrinsics) lens_ = std::exchange(next, next + 9);
    for (const CalibrationView& view : views) free_.push_back(view.place == BoardPlace::kFree ? std::exchange(next, next + 6) : -1);
    count_ = next;
  }

  Eigen::Index count() const noexcept { return count_; }
  Eigen::Index lens() const noexcept { return lens_; }

  CameraModel camera(const Eigen::VectorXd& x) const {
    CameraModel camera = guess_.camera;
    camera.X_WC = nearby(guess_.camera.X_WC, x.head<6>());
    if (lens_ < 0) return camera;
    // Scaled so that all are of the order of 1 px at the image's border.
    camera.fx += x[lens_] * 1.0;
    camera.fy += x[lens_ + 1] * 1.0;
    camera.cx += x[lens_ + 2];
    camera.cy += x[lens_ + 3];
    for (Eigen::Index i = 0; i < 5; ++i) camera.distortion[static_cast<std::size_t>(i)] += 1e-3 * x[lens_ + 4 + i];
    return camera;
  }
  Pose X_TP(const Eigen::VectorXd& x) const { return tip_ < 0 ? guess_.X_TP : nearby(guess_.X_TP, x.segment<6>(tip_)); }
  /// Of the board of a view.
  Pose X_WP(std::size_t view, const Eigen::VectorXd& x) const {
    switch (views_[view].place) {
      case BoardPlace::kTable: return views_[view].X_WP;
      case BoardPlace::kArm: return views_[view].X_WT * X_TP(x);
      case BoardPlace::kFree: break;
    }
    // Bound to the camera, so that a step of the camera does not drag it through the image.
    return camera(x).X_WC * nearby(guess_.X_CP[view], x.segment<6>(free_[view]));
  }

 private:
  const std::vector<CalibrationView>& views_;
  const Guess& guess_;
  Eigen::Index tip_ = -1, lens_ = -1, count_ = 6;
  std::vector<Eigen::Index> free_;
};

Eigen::Index coordinates(const std::vector<CalibrationView>& views) {
  std::size_t corners = 0;
  for (const CalibrationView& view : views) corners += view.seen.p_P.size();
  return static_cast<Eigen::Index>(2 * corners);
}

/// How many pictures show the board where another one shows it too: at most, for any one place.
int alike(const std::vector<CalibrationView>& views) {
  constexpr double kSame = 1.0;  // px
  int most = 1;
  for (const CalibrationView& a : views) {
    const auto same = [&](const CalibrationView& b) {
      if (a.seen.p_P.size() != b.seen.p_P.size()) return false;
      double sum = 0.0;
      for (std::size_t i = 0; i < a.seen.p_pixel.size(); ++i) sum += (a.seen.p_pixel[i] - b.seen.p_pixel[i]).norm();
      return sum < kSame * static_cast<double>(a.seen.p_pixel.size());
    };
    most = std::max(most, static_cast<int>(std::count_if(views.begin(), views.end(), same)));
  }
  return most;
}

/// Standard deviation of where the lens puts a ray, px, at the worst place of a grid over the image.
double lens_sigma(const Unknowns& unknowns, const Eigen::VectorXd& x, const Eigen::MatrixXd& covariance) {
  const CameraModel camera = unknowns.camera(x);
  double worst = 0.0;
  for (const double u : {0.0, 0.5, 1.0}) {
    for (const double v : {0.0, 0.5, 1.0}) {
      const Vector2 p = camera.point_on_plane({u * (camera.width - 1), v * (camera.height - 1)}, 0.0);
      Eigen::MatrixXd slope(2, unknowns.count());
      slope.setZero();
      for (Eigen::Index i = 0; i < 9; ++i) {
        const auto at = [&](double step) {
          Eigen::VectorXd moved = x;
          moved[unknowns.lens() + i] += step;
          CameraModel other = unknowns.camera(moved);
          other.X_WC = camera.X_WC;
          return other.project({p.x(), p.y(), 0.0}).value_or(Vector2::Zero());
        };
        slope.col(unknowns.lens() + i) = (at(1e-4) - at(-1e-4)) / 2e-4;
      }
      worst = std::max(worst, std::sqrt((slope * covariance * slope.transpose()).eval().eigenvalues().real().maxCoeff()));
    }
  }
  return worst;
}

double largest_sigma(const Matrix3& covariance) {
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix3>{covariance}.eigenvalues().maxCoeff());
}

}  // namespace

Result<Calibration, CalibrationRefusal> calibrate(const std::vector<CalibrationView>& views, const Board& board, const CameraModel& start,
                                                  const CalibrationSettings& settings) {
  if (auto refusal = check_views(views, board, start)) return *refusal;
  if (auto refusal = check_arm(views)) return *refusal;
  auto guess = initial_guess(views, start, settings.intrinsics);
  if (!guess) return guess.error();
  if (settings.intrinsics) {
    if (auto refusal = check_lens(views, *guess)) return *refusal;
  }

  const Unknowns unknowns{views, *guess, settings.intrinsics};
  const Eigen::Index count = coordinates(views);
  double sigma = kFirstSigma;
  const Residuals residuals = [&](const Eigen::VectorXd& x, Eigen::VectorXd& r) {
    const CameraModel camera = unknowns.camera(x);
    Eigen::Index row = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const Pose X_WP = unknowns.X_WP(v, x);
      for (std::size_t i = 0; i < views[v].seen.p_P.size(); ++i, row += 2) {
        const auto pixel = camera.project(X_WP * views[v].seen.p_P[i]);
        r.segment<2>(row) = pixel ? Vector2{(*pixel - views[v].seen.p_pixel[i]) / sigma} : Vector2::Constant(1e6);
      }
    }
  };
  // Twice: the first time finds how large errors are, by which the second tells what fits badly. The median, because that is what outliers leave alone.
  Eigen::VectorXd x = Eigen::VectorXd::Zero(unknowns.count());
  LeastSquaresFit fit;
  for (int round = 0; round < 2; ++round) {
    fit = least_squares(residuals, x, count, kHuber);
    x = fit.x;
    std::vector<double> sizes(static_cast<std::size_t>(count));
    for (Eigen::Index i = 0; i < count; ++i) sizes[static_cast<std::size_t>(i)] = sigma * std::abs(fit.residuals[i]);
    std::nth_element(sizes.begin(), sizes.begin() + count / 2, sizes.end());
    if (round == 0) sigma = std::max(1e-3, 1.4826 * sizes[static_cast<std::size_t>(count / 2)]);
  }

  Calibration result;
  result.camera = unknowns.camera(x);
  if (std::any_of(views.begin(), views.end(), [](const CalibrationView& view) { return view.place == BoardPlace::kArm; }))
    result.X_TP = unknowns.X_TP(x);
  const Eigen::VectorXd pixels = sigma * fit.residuals;
  const double degrees = static_cast<double>(std::max<Eigen::Index>(1, count - unknowns.count()));
  result.residual = std::sqrt(pixels.squaredNorm() / static_cast<double>(count));
  Eigen::Index row = 0;
  for (const CalibrationView& view : views) {
    const auto size = static_cast<Eigen::Index>(2 * view.seen.p_P.size());
    result.views.push_back(
        {view.seen.picture, static_cast<int>(size / 2), std::sqrt(pixels.segment(row, size).squaredNorm() / static_cast<double>(size))});
    row += size;
  }
  // Of weighted corners the variance is that of their weighted residuals.
  const double variance =
      (fit.weights.array() * pixels.array().square()).sum() / degrees + (alike(views) - 1) * kSharedSigma * kSharedSigma;
  const Eigen::MatrixXd covariance = variance / (sigma * sigma) * fit.inverse;
  result.covariance = covariance.topLeftCorner<6, 6>();
  result.turn_sigma = largest_sigma(result.covariance.topLeftCorner<3, 3>());
  result.p_sigma = largest_sigma(result.covariance.bottomRightCorner<3, 3>());
  if (settings.intrinsics) result.lens_sigma = lens_sigma(unknowns, x, covariance);
  if (auto refusal = check_result(result, settings)) return *refusal;
  return result;
}

}  // namespace breakshot::perception
