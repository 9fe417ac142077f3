#include "tests/perception/board_image.hpp"

#include <opencv2/imgproc.hpp>

#include <cmath>
#include <vector>

namespace breakshot::perception::test {
namespace {

constexpr double kDot = 1e-4;      // m, of the raster
constexpr double kMargin = 0.010;  // m
constexpr int kRays = 6;           // per side of a pixel
constexpr double kWhite = 225.0, kBlack = 30.0, kTable = 150.0;

int dots(double length) { return static_cast<int>(std::lround(length / kDot)); }

}  // namespace

BoardPainter::BoardPainter(const Board& board)
    : low_{-kMargin, -kMargin},
      raster_(dots(board.rows * board.square + 2.0 * kMargin), dots(board.columns * board.square + 2.0 * kMargin), std::uint8_t{255}) {
  for (const Ink& ink : ink_of(board)) {
    const Vector2 low = ink.low - low_, high = ink.high - low_;
    raster_(cv::Rect{cv::Point{dots(low.x()), dots(low.y())}, cv::Point{dots(high.x()), dots(high.y())}}) = std::uint8_t{0};
  }
}

cv::Mat1b BoardPainter::paint(const CameraModel& camera, const Pose& X_WP, std::uint64_t seed, double noise) const {
  // Where the corners of all pixels see the board's plane, in dots; between them linear.
  const Pose X_PC = X_WP.inverse() * camera.X_WC;
  const int columns = camera.width + 1;
  CameraModel level = camera;  // looks along z, from 1 above a plane: then a point of the plane is a ray
  level.X_WC = Pose::Identity();
  std::vector<Vector2> at(static_cast<std::size_t>(columns * (camera.height + 1)));
  for (int y = 0; y <= camera.height; ++y) {
    for (int x = 0; x < columns; ++x) {
      const Vector2 ray = level.point_on_plane({x - 0.5, y - 0.5}, 1.0);
      const Vector3 direction_P = X_PC.linear() * ray.homogeneous();
      const double range = -X_PC.translation().z() / direction_P.z();
      const Vector2 p = (X_PC.translation() + range * direction_P).head<2>();
      at[static_cast<std::size_t>(y * columns + x)] = range > 0.0 ? Vector2{(p - low_) / kDot} : Vector2::Constant(-1e6);
    }
  }
  cv::Mat1f image(camera.height, camera.width);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vector2* top = &at[static_cast<std::size_t>(y * columns + x)];
      const Vector2* bottom = top + columns;
      double sum = 0.0;
      for (int i = 0; i < kRays; ++i) {
        for (int j = 0; j < kRays; ++j) {
          const double u = (i + 0.5) / kRays, v = (j + 0.5) / kRays;
          const Vector2 dot = (1.0 - v) * ((1.0 - u) * top[0] + u * top[1]) + v * ((1.0 - u) * bottom[0] + u * bottom[1]);
          const bool inside = dot.x() >= 0.0 && dot.y() >= 0.0 && dot.x() < raster_.cols && dot.y() < raster_.rows;
          sum += !inside ? kTable : raster_(static_cast<int>(dot.y()), static_cast<int>(dot.x())) != 0 ? kWhite : kBlack;
        }
      }
      const double light = 0.8 + 0.2 * x / camera.width;  // brighter on the right
      image(y, x) = static_cast<float>(light * sum / (kRays * kRays));
    }
  }
  cv::GaussianBlur(image, image, {0, 0}, 0.6);
  SplitMix64 random{seed};
  cv::Mat1b grey(image.size());
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x)
      grey(y, x) = cv::saturate_cast<std::uint8_t>(static_cast<double>(image(y, x)) + noise * random.normal());
  }
  return grey;
}

}  // namespace breakshot::perception::test
