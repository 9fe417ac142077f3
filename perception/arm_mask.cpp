#include "perception/arm_mask.hpp"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace breakshot::perception {
namespace {

constexpr int kSides = 16;         // of the prism that stands for a cylinder
constexpr double kPiece = 0.05;    // m: long shapes are cut up, so that what leaves the camera's view takes little with it
constexpr double kNearest = 0.05;  // m in front of the camera: a piece that is nearer is beside the view, or has hit the camera

// A ring of corners around a circle in the plane z.
void add_ring(std::vector<Vector3>& corners, const Pose& X_LS, double radius, double z) {
  const double outer = radius / std::cos(CV_PI / kSides);
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * CV_PI * i / kSides;
    corners.push_back(X_LS * Vector3{outer * std::cos(angle), outer * std::sin(angle), z});
  }
}

}  // namespace

ArmMask::ArmMask(const CameraModel& camera, const ArmDescription& arm, const Pose& X_WB, double margin)
    : camera_{camera}, margin_{margin}, X_WB_{X_WB}, base_{pieces_of(arm.base)}, mask_(camera.height, camera.width, std::uint8_t{0}) {
  const Vector2 corner{std::max(camera.cx, camera.width - camera.cx) / camera.fx,
                       std::max(camera.cy, camera.height - camera.cy) / camera.fy};
  max_range_ = 1.5 * corner.norm();
  for (const LinkDescription& link : arm.links) links_.push_back(pieces_of(link));
}

std::vector<ArmMask::Corners> ArmMask::pieces_of(const LinkDescription& link) const {
  std::vector<Corners> pieces;
  for (const Shape& shape : link.collisions) {
    // Every kind is a stack of cross-sections along z of its frame.
    const double half = margin_ + (shape.kind == Shape::Kind::kBox        ? 0.5 * shape.size.z()
                                   : shape.kind == Shape::Kind::kCylinder ? 0.5 * shape.size.y()
                                                                          : shape.size.x());
    const int cuts = std::max(shape.kind == Shape::Kind::kSphere ? 4 : 1, static_cast<int>(std::ceil(2.0 * half / kPiece)));
    const auto add_section = [&](Corners& corners, double z, double widest_z) {
      if (shape.kind == Shape::Kind::kBox) {
        for (const double x : {-1.0, 1.0}) {
          for (const double y : {-1.0, 1.0}) {
            corners.push_back(shape.X_LS * Vector3{x * (0.5 * shape.size.x() + margin_), y * (0.5 * shape.size.y() + margin_), z});
          }
        }
        return;
      }
      const double radius = shape.size.x() + margin_;
      const bool sphere = shape.kind == Shape::Kind::kSphere;
      add_ring(corners, shape.X_LS, sphere ? std::sqrt(std::max(0.0, radius * radius - widest_z * widest_z)) : radius, z);
    };
    for (int i = 0; i < cuts; ++i) {
      const double low = -half + 2.0 * half * i / cuts, high = -half + 2.0 * half * (i + 1) / cuts;
      // A slice of a sphere lies in the cylinder around its widest section.
      const double widest = low > 0.0 ? low : high < 0.0 ? high : 0.0;
      Corners corners;
      add_section(corners, low, widest);
      add_section(corners, high, widest);
      pieces.push_back(std::move(corners));
    }
  }
  return pieces;
}

void ArmMask::place(std::span<const Pose> X_WL) {
  if (!X_WL.empty() && X_WL.size() != links_.size()) {
    throw std::invalid_argument("perception: found poses of " + std::to_string(X_WL.size()) + " links; the arm has " +
                                std::to_string(links_.size()));
  }
  known_ = !X_WL.empty();
  if (!known_) return;
  mask_ = std::uint8_t{0};
  for (const Corners& piece : base_) draw(piece, X_WB_);
  for (std::size_t i = 0; i < links_.size(); ++i) {
    for (const Corners& piece : links_[i]) draw(piece, X_WL[i]);
  }
}

void ArmMask::draw(const Corners& piece, const Pose& X_WL) {
  const Pose X_CL = camera_.X_WC.inverse() * X_WL;
  corners_px_.clear();
  for (const Vector3& p_L : piece) {
    Vector3 p_C = X_CL * p_L;
    if (p_C.z() < kNearest) return;
    const double range = p_C.head<2>().norm() / p_C.z();
    if (range > max_range_) p_C.head<2>() *= max_range_ / range;
    const auto pixel = camera_.project(camera_.X_WC * p_C);
    corners_px_.emplace_back(static_cast<int>(std::lround(pixel->x())), static_cast<int>(std::lround(pixel->y())));
  }
  cv::convexHull(corners_px_, hull_px_);
  cv::fillConvexPoly(mask_, hull_px_, 255);
}

}  // namespace breakshot::perception
