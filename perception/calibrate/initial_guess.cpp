#include "perception/calibrate/initial_guess.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include <algorithm>

namespace breakshot::perception {
namespace {

std::vector<cv::Point3f> board_points(const BoardView& view) {
  std::vector<cv::Point3f> points;
  for (const Vector3& p : view.p_P) points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
  return points;
}

std::vector<cv::Point2f> image_points(const BoardView& view) {
  std::vector<cv::Point2f> points;
  for (const Vector2& p : view.p_pixel) points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  return points;
}

cv::Matx33d camera_matrix(const CameraModel& camera) { return {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0}; }

Pose to_pose(const cv::Mat& R, const cv::Mat& t) {
  Matrix3 rotation;
  Vector3 translation;
  cv::cv2eigen(R, rotation);
  cv::cv2eigen(t, translation);
  Pose X{Pose::Identity()};
  X.linear() = Eigen::Quaterniond{rotation}.normalized().toRotationMatrix();
  X.translation() = translation;
  return X;
}

void push_back(const Pose& X, std::vector<cv::Mat>& R, std::vector<cv::Mat>& t) {
  const Matrix3 rotation = X.linear();
  const Vector3 translation = X.translation();
  cv::eigen2cv(rotation, R.emplace_back());
  cv::eigen2cv(translation, t.emplace_back());
}

// Zhang's method, from scratch: what the file says of the lens may be far off.
void guess_lens(const std::vector<CalibrationView>& views, CameraModel& camera) {
  std::vector<std::vector<cv::Point3f>> boards;
  std::vector<std::vector<cv::Point2f>> images;
  for (const CalibrationView& view : views) {
    boards.push_back(board_points(view.seen));
    images.push_back(image_points(view.seen));
  }
  cv::Matx33d K;
  cv::Mat distortion, rotations, translations;
  cv::calibrateCamera(boards, images, {camera.width, camera.height}, K, distortion, rotations, translations);
  camera.fx = K(0, 0);
  camera.fy = K(1, 1);
  camera.cx = K(0, 2);
  camera.cy = K(1, 2);
  for (int i = 0; i < 5; ++i) camera.distortion[static_cast<std::size_t>(i)] = distortion.at<double>(i);
}

// C to P through the arm is C to W, W to T (known), T to P: A X = Z B.
void guess_arm(const std::vector<CalibrationView>& views, Guess& guess) {
  std::vector<cv::Mat> R_PC, t_PC, R_TW, t_TW;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].place != BoardPlace::kArm) continue;
    push_back(guess.X_CP[i].inverse(), R_PC, t_PC);
    push_back(views[i].X_WT.inverse(), R_TW, t_TW);
  }
  cv::Mat R_CW, t_CW, R_PT, t_PT;
  cv::calibrateRobotWorldHandEye(R_PC, t_PC, R_TW, t_TW, R_CW, t_CW, R_PT, t_PT);
  guess.camera.X_WC = to_pose(R_CW, t_CW).inverse();
  guess.X_TP = to_pose(R_PT, t_PT).inverse();
}

Result<Guess, CalibrationRefusal> guess_all(const std::vector<CalibrationView>& views, const CameraModel& start, bool intrinsics) {
  Guess guess{start, {}, Pose::Identity()};
  if (intrinsics) guess_lens(views, guess.camera);
  for (const CalibrationView& view : views) {
    cv::Mat turn, t, R;
    const bool solved = cv::solvePnP(board_points(view.seen), image_points(view.seen), camera_matrix(guess.camera), guess.camera.distortion,
                                     turn, t, false, cv::SOLVEPNP_IPPE);
    if (!solved || !cv::checkRange(t)) return CalibrationRefusal{view.seen.picture + ": found corners that no board shows"};
    cv::Rodrigues(turn, R);
    guess.X_CP.push_back(to_pose(R, t));
  }
  const auto held = std::count_if(views.begin(), views.end(), [](const CalibrationView& view) { return view.place == BoardPlace::kArm; });
  if (held >= 3) {
    guess_arm(views, guess);
    return guess;
  }
  const CalibrationView* best = nullptr;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (views[i].place != BoardPlace::kTable || (best != nullptr && best->seen.p_P.size() >= views[i].seen.p_P.size())) continue;
    best = &views[i];
    guess.camera.X_WC = views[i].X_WP * guess.X_CP[i].inverse();
  }
  return guess;
}

}  // namespace

Result<Guess, CalibrationRefusal> initial_guess(const std::vector<CalibrationView>& views, const CameraModel& start, bool intrinsics) {
  try {
    return guess_all(views, start, intrinsics);
  } catch (const cv::Exception& error) {
    return CalibrationRefusal{"no camera explains the pictures, not even roughly (" + error.err + ")"};
  }
}

}  // namespace breakshot::perception
