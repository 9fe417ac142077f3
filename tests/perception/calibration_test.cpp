// Calibration on painted pictures of boards: what comes out against what is true, whether the stated standard deviations are right, and what is refused.

#include "perception/calibrate/calibration.hpp"

#include "perception/least_squares.hpp"
#include "tests/perception/board_image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

namespace breakshot::perception::test {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

Pose looking_down(const Vector3& p_W, double tilt_x = 0.0, double tilt_y = 0.0, double turn = 0.0) {
  Pose X{Pose::Identity()};
  X.translation() = p_W;
  X.linear() = (Eigen::AngleAxisd{turn, Vector3::UnitZ()} * Eigen::AngleAxisd{std::numbers::pi + tilt_x, Vector3::UnitX()} *
                Eigen::AngleAxisd{tilt_y, Vector3::UnitY()})
                   .toRotationMatrix();
  return X;
}

class CalibrationTest : public ::testing::Test {
 protected:
  static CameraModel true_camera() {
    CameraModel camera;
    camera.fx = 917.3;
    camera.fy = 915.8;
    camera.cx = 643.4;
    camera.cy = 355.2;
    camera.distortion = {0.06, -0.11, 0.0006, -0.0004, 0.03};
    camera.X_WC = looking_down({0.013, -0.008, 0.806}, 0.021, -0.014, 0.03);
    return camera;
  }
  // On the table, somewhere near the middle.
  CalibrationView on_table(const Pose& X_WP, double noise = 2.0) {
    ++pictures;
    return {detector.find(painter.paint(truth, X_WP, pictures, noise), "table" + std::to_string(pictures) + ".png"), BoardPlace::kTable,
            X_WP, Pose::Identity()};
  }
  Pose lying(double dx, double dy, double yaw) const {
    Pose X{Pose::Identity()};
    X.rotate(Eigen::AngleAxisd{yaw, Vector3::UnitZ()});
    X.translation() = Vector3{dx, dy, 0.002} + X.linear() * board.X_WP.translation();
    return X;
  }
  // Somewhere between the table and the camera, tilted by up to 40 degrees.
  Pose held() {
    Pose X{Pose::Identity()};
    X.translation() << random.uniform(-0.2, 0.2), random.uniform(-0.1, 0.1), random.uniform(0.1, 0.3);
    const Vector3 axis = Vector3{random.normal(), random.normal(), 0.0}.normalized();
    X.rotate(Eigen::AngleAxisd{random.uniform(15.0, 40.0) * kDegree, axis});
    X.rotate(Eigen::AngleAxisd{random.uniform(-0.5, 0.5), Vector3::UnitZ()});
    return X * Eigen::Translation3d{-0.5 * board.columns * board.square, -0.5 * board.rows * board.square, 0.0};
  }
  CalibrationView free() {
    ++pictures;
    return {detector.find(painter.paint(truth, held(), pictures), "free" + std::to_string(pictures) + ".png"), BoardPlace::kFree, {}, {}};
  }
  // At the arm: the tip points down, tilted and turned in all ways; the board is clamped to it crookedly.
  CalibrationView at_arm(const Pose& X_WT) {
    ++pictures;
    return {
        detector.find(painter.paint(truth, X_WT * X_TP, pictures), "arm" + std::to_string(pictures) + ".png"), BoardPlace::kArm, {}, X_WT};
  }
  Pose tip() {
    return looking_down({random.uniform(-0.1, 0.1), random.uniform(-0.08, 0.08), random.uniform(0.05, 0.25)}, random.uniform(-0.4, 0.4),
                        random.uniform(-0.4, 0.4), random.uniform(-1.0, 1.0));
  }
  // What is still wrong: rotation vector and shift in W, as Calibration::covariance has them.
  static Eigen::Matrix<double, 6, 1> error(const Pose& found, const Pose& is) {
    const Eigen::AngleAxisd turn{Matrix3{found.linear() * is.linear().transpose()}};
    Eigen::Matrix<double, 6, 1> e;
    e << turn.angle() * turn.axis(), found.translation() - is.translation();
    return e;
  }
  std::string refusal(const std::vector<CalibrationView>& views, const CalibrationSettings& settings = {}) const {
    const auto result = calibrate(views, board, start, settings);
    return result ? "no refusal" : result.error().text;
  }

  Board board{MarkerDictionary::k5x5, 12, 8, 0.033, 0.024, Pose{Eigen::Translation3d{-0.198, -0.132, 0.0}}};
  BoardDetector detector{board};
  BoardPainter painter{board};
  CameraModel truth = true_camera();
  CameraModel start = [this] {
    CameraModel camera = truth;
    camera.X_WC = Pose::Identity();
    return camera;
  }();
  Pose X_TP = looking_down({-0.2, 0.13, 0.01}, 0.1, -0.15, 0.2);
  SplitMix64 random{5};
  std::uint64_t pictures = 0;
};

TEST_F(CalibrationTest, EveryCornerIsFoundToAFewHundredthsOfAPixel) {
  const CalibrationView view = on_table(lying(0.0, 0.0, 0.3));
  ASSERT_EQ(static_cast<int>(view.seen.p_P.size()), board.corners());
  double sum = 0.0, worst = 0.0;
  for (std::size_t i = 0; i < view.seen.p_P.size(); ++i) {
    const double off = (*truth.project(view.X_WP * view.seen.p_P[i]) - view.seen.p_pixel[i]).norm();
    sum += off * off;
    worst = std::max(worst, off);
  }
  std::printf("  %.3f px RMS, %.3f px at most\n", std::sqrt(sum / board.corners()), worst);
  EXPECT_LT(std::sqrt(sum / board.corners()), 0.1);
  EXPECT_LT(worst, 0.3);
}

TEST_F(CalibrationTest, ABoardOnTheTableGivesThePoseAndHowSureItIs) {
  constexpr int kRuns = 30;
  double nees = 0.0, worst_p = 0.0, worst_turn = 0.0, p_sigma = 0.0, turn_sigma = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<CalibrationView> views;
    const Pose X_WP = lying(random.uniform(-0.05, 0.05), random.uniform(-0.02, 0.02), random.uniform(-0.1, 0.1));
    for (int i = 0; i < 2; ++i) views.push_back(on_table(X_WP));
    CalibrationSettings settings;
    settings.max_p_sigma = 1e-3;
    const auto result = calibrate(views, board, start, settings);
    ASSERT_TRUE(result) << result.error().text;
    const auto e = error(result->camera.X_WC, truth.X_WC);
    worst_turn = std::max(worst_turn, e.head<3>().norm());
    worst_p = std::max(worst_p, e.tail<3>().norm());
    nees += e.dot(result->covariance.inverse() * e);
    p_sigma = std::max(p_sigma, result->p_sigma);
    turn_sigma = std::max(turn_sigma, result->turn_sigma);
    EXPECT_LT(result->residual, 0.1);
  }
  std::printf("  %d runs of two pictures: worst %.3f mm and %.4f deg, stated %.3f mm and %.4f deg, NEES %.2f (6 is right)\n", kRuns,
              1e3 * worst_p, worst_turn / kDegree, 1e3 * p_sigma, turn_sigma / kDegree, nees / kRuns);
  EXPECT_LT(worst_p, 1e-3);
  EXPECT_LT(worst_turn, 0.07 * kDegree);
  EXPECT_GT(nees / kRuns, 4.0) << "the mean of 30 is within 4.8 and 7.3, 95 % of the time";
  EXPECT_LT(nees / kRuns, 9.0);
}

TEST_F(CalibrationTest, AFewPlacesOnTheTableGiveItToATenthOfThat) {
  std::vector<CalibrationView> views;
  for (const double dx : {-0.14, 0.0, 0.14}) {
    for (const double dy : {-0.05, 0.05}) views.push_back(on_table(lying(dx, dy, 3.0 * dx)));
  }
  const auto result = calibrate(views, board, start, {});
  ASSERT_TRUE(result) << result.error().text;
  const auto e = error(result->camera.X_WC, truth.X_WC);
  std::printf("  error %.3f mm and %.4f deg, stated %.3f mm and %.4f deg\n", 1e3 * e.tail<3>().norm(), e.head<3>().norm() / kDegree,
              1e3 * result->p_sigma, result->turn_sigma / kDegree);
  EXPECT_LT(e.tail<3>().norm(), 0.2e-3);
  EXPECT_LT(e.head<3>().norm(), 0.02 * kDegree);
  EXPECT_EQ(result->views.size(), views.size());
}

TEST_F(CalibrationTest, ABoardAtTheArmGivesThePoseAndItsOwn) {
  constexpr int kRuns = 4;
  double nees = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<CalibrationView> views;
    while (views.size() < 10) {
      CalibrationView view = at_arm(tip());
      if (static_cast<int>(view.seen.p_P.size()) > board.corners() / 2) views.push_back(view);
    }
    const auto result = calibrate(views, board, start, {});
    ASSERT_TRUE(result) << result.error().text;
    const auto e = error(result->camera.X_WC, truth.X_WC);
    nees += e.dot(result->covariance.inverse() * e);
    std::printf("  error %.3f mm and %.4f deg, stated %.3f mm and %.4f deg\n", 1e3 * e.tail<3>().norm(), e.head<3>().norm() / kDegree,
                1e3 * result->p_sigma, result->turn_sigma / kDegree);
    EXPECT_LT(e.tail<3>().norm(), 0.2e-3);
    EXPECT_LT(e.head<3>().norm(), 0.02 * kDegree);
    ASSERT_TRUE(result->X_TP);
    EXPECT_LT((result->X_TP->translation() - X_TP.translation()).norm(), 0.2e-3);
  }
  EXPECT_LT(nees / kRuns, 15.0) << "6 is right; four runs scatter";
}

TEST_F(CalibrationTest, TheLensIsFoundFromATableBoardAndFreeOnes) {
  std::vector<CalibrationView> views;
  for (const double dx : {-0.1, 0.1}) views.push_back(on_table(lying(dx, 0.0, dx)));
  while (views.size() < 20) {
    CalibrationView view = free();
    if (static_cast<int>(view.seen.p_P.size()) > board.corners() / 2) views.push_back(view);
  }
  start.fx = start.fy = 870.0;
  start.cx = 639.5;
  start.cy = 359.5;
  start.distortion = {};
  CalibrationSettings settings;
  settings.intrinsics = true;
  const auto result = calibrate(views, board, start, settings);
  ASSERT_TRUE(result) << result.error().text;
  const auto e = error(result->camera.X_WC, truth.X_WC);
  // Where the found camera puts places of the table that the true one sees: all that the cell needs of it.
  double worst = 0.0;
  for (const double u : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    for (const double v : {0.0, 0.5, 1.0}) {
      const Vector2 pixel{u * 1279.0, v * 719.0};
      worst = std::max(worst, (result->camera.point_on_plane(pixel, 0.0) - truth.point_on_plane(pixel, 0.0)).norm());
    }
  }
  std::printf(
      "  f %.2f %.2f, c %.2f %.2f; pose off by %.3f mm and %.4f deg, stated %.3f mm and %.4f deg; lens sure to %.3f px; the table off by "
      "%.3f mm at most\n",
      result->camera.fx, result->camera.fy, result->camera.cx, result->camera.cy, 1e3 * e.tail<3>().norm(), e.head<3>().norm() / kDegree,
      1e3 * result->p_sigma, result->turn_sigma / kDegree, result->lens_sigma, 1e3 * worst);
  EXPECT_LT(worst, 0.6e-3);
  EXPECT_LT(e.dot(result->covariance.inverse() * e), 22.5) << "99.9 % of the time";
  EXPECT_LT(result->residual, 0.1);
}

TEST_F(CalibrationTest, CornersThatAreWrongDoNotPullTheRest) {
  std::vector<CalibrationView> views;
  for (const double dx : {-0.1, 0.0, 0.1}) views.push_back(on_table(lying(dx, 0.0, 0.0)));
  for (CalibrationView& view : views) {
    for (std::size_t i = 0; i < view.seen.p_pixel.size(); i += 20) view.seen.p_pixel[i] += Vector2{1.5, -1.0};
  }
  const auto result = calibrate(views, board, start, {});
  ASSERT_TRUE(result) << result.error().text;
  const auto e = error(result->camera.X_WC, truth.X_WC);
  EXPECT_LT(e.tail<3>().norm(), 0.4e-3);
  EXPECT_LT(e.head<3>().norm(), 0.03 * kDegree);
}

TEST_F(CalibrationTest, RefusesWithTheReason) {
  const CalibrationView good = on_table(lying(0.0, 0.0, 0.0));
  EXPECT_THAT(refusal({}), HasSubstr("found no pictures"));

  CalibrationView blank = good;
  blank.seen = detector.find(cv::Mat1b(720, 1280, std::uint8_t{120}), "blank.png");
  EXPECT_THAT(refusal({good, blank}), HasSubstr("blank.png: the board was not found (0 of its markers were read)"));

  CalibrationView few = good;
  few.seen.p_P.resize(10);
  few.seen.p_pixel.resize(10);
  EXPECT_THAT(refusal({few}), HasSubstr("found 10 of the board's 77 corners; needed: 20"));

  CalibrationView row = good;
  row.seen.p_P.clear();
  row.seen.p_pixel.clear();
  for (std::size_t i = 0; i < 22; ++i) {
    row.seen.p_P.push_back(good.seen.p_P[i % 11]);
    row.seen.p_pixel.push_back(good.seen.p_pixel[i % 11]);
  }
  EXPECT_THAT(refusal({row}), HasSubstr("corners in one row only"));

  CalibrationView narrow = good;
  for (Vector2& p : narrow.seen.p_pixel) p.x() = 500.0 + 0.1 * p.x();
  EXPECT_THAT(refusal({narrow}), HasSubstr("of the image's width"));

  // A board that was moved between two pictures.
  CalibrationView moved = on_table(lying(0.02, 0.0, 0.0));
  moved.X_WP = good.X_WP;
  EXPECT_THAT(refusal({good, good, moved}), HasSubstr(moved.seen.picture + ": found residuals of"));

  // Another size than stated: the pose takes it all up, unless the corners are somewhere else, too.
  start.fx *= 1.05;
  EXPECT_THAT(refusal({good, on_table(lying(0.1, 0.04, 0.5)), on_table(lying(-0.1, -0.04, -0.5))}), HasSubstr("px RMS"));
  start = truth;

  CalibrationSettings strict;
  strict.max_p_sigma = 1e-6;
  EXPECT_THAT(refusal({good}, strict), HasSubstr("the pose is sure to"));

  CalibrationView alone = good;
  alone.place = BoardPlace::kFree;
  EXPECT_THAT(refusal({alone}), HasSubstr("no picture of a board at a known place"));
}

TEST_F(CalibrationTest, RefusesPicturesThatAreAllAlike) {
  CalibrationSettings lens;
  lens.intrinsics = true;
  const CalibrationView good = on_table(lying(0.0, 0.0, 0.0));
  EXPECT_THAT(refusal({good}, lens), HasSubstr("found 1 pictures; needed for the lens: 6"));
  std::vector<CalibrationView> flat;
  for (int i = 0; i < 6; ++i) flat.push_back(on_table(lying(0.08 * (i % 3 - 1), 0.04 * (i % 2), 0.2 * i)));
  EXPECT_THAT(refusal(flat, lens), HasSubstr("no two boards are tilted by more than"));

  std::vector<CalibrationView> arm;
  for (int i = 0; i < 7; ++i) arm.push_back(at_arm(looking_down({0.02 * i - 0.06, 0.01 * i, 0.1}, 0.0, 0.0, 0.1 * i)));
  EXPECT_THAT(refusal(arm), HasSubstr("the pictures are too much alike: the arm turns the board by 0 deg about a second axis"));
  arm.resize(3);
  EXPECT_THAT(refusal(arm), HasSubstr("found 3 pictures of the board at the arm; needed: 6"));
}

TEST_F(CalibrationTest, JointsThatBelongToAnotherPictureAreFound) {
  std::vector<CalibrationView> views;
  while (views.size() < 9) {
    CalibrationView view = at_arm(tip());
    if (static_cast<int>(view.seen.p_P.size()) > board.corners() / 2) views.push_back(view);
  }
  views[4].X_WT.translation() += Vector3{0.004, 0.0, 0.0};
  EXPECT_THAT(refusal(views), HasSubstr(views[4].seen.picture));
}

}  // namespace
}  // namespace breakshot::perception::test
