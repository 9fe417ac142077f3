#include "tests/bench/perception/hough.hpp"

#include <opencv2/imgproc.hpp>

#include <cstdio>
#include <vector>

namespace breakshot::bench {

std::string to_string(const HoughSettings& s) {
  char text[160];
  std::snprintf(text, sizeof text, "%s on %s, dp %.1f, param1 %.0f, param2 %.2f, blur %.1f px",
                s.gradient_alt ? "HOUGH_GRADIENT_ALT" : "HOUGH_GRADIENT", s.saturation ? "saturation" : "grey", s.dp, s.edge, s.votes,
                s.blur);
  return text;
}

Finding hough(const ColorFrame& frame, const CameraModel& camera, double disc_height, double radius_min, double radius_max,
              double touch_gap, const HoughSettings& s) {
  const cv::Mat rgb(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.rgb.data()));
  cv::Mat one;
  if (s.saturation) {
    cv::Mat hsv;
    cv::cvtColor(rgb, hsv, cv::COLOR_RGB2HSV);
    cv::extractChannel(hsv, one, 1);
  } else {
    cv::cvtColor(rgb, one, cv::COLOR_RGB2GRAY);
  }
  if (s.blur > 0.0) cv::GaussianBlur(one, one, {0, 0}, s.blur);
  const double pixels_per_metre = camera.fx / (camera.X_WC.translation().z() - disc_height);
  std::vector<cv::Vec3f> circles;
  cv::HoughCircles(one, circles, s.gradient_alt ? cv::HOUGH_GRADIENT_ALT : cv::HOUGH_GRADIENT, s.dp, 1.8 * radius_min * pixels_per_metre,
                   s.edge, s.votes, static_cast<int>(0.95 * radius_min * pixels_per_metre),
                   static_cast<int>(1.05 * radius_max * pixels_per_metre));
  Finding finding;
  for (const cv::Vec3f& circle : circles) {
    FoundDisc disc;
    disc.p_WD = camera.point_on_plane({circle[0], circle[1]}, disc_height);
    disc.radius = circle[2] / pixels_per_metre;
    finding.discs.push_back(disc);
  }
  for (std::size_t a = 0; a < finding.discs.size(); ++a) {
    for (std::size_t b = a + 1; b < finding.discs.size(); ++b) {
      const FoundDisc& disc_a = finding.discs[a];
      const FoundDisc& disc_b = finding.discs[b];
      if ((disc_a.p_WD - disc_b.p_WD).norm() - disc_a.radius - disc_b.radius < touch_gap) finding.touching.emplace_back(a, b);
    }
  }
  return finding;
}

}  // namespace breakshot::bench
