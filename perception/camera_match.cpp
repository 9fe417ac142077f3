#include "perception/camera_match.hpp"

#include <array>
#include <cmath>
#include <sstream>

namespace breakshot::perception {
namespace {

// Far below what could be measured in an image, far above the rounding of a number that went through a file or over the wire.
constexpr double kPixels = 1e-3;
constexpr double kRatio = 1e-6;  // distortion coefficients, entries of the rotation; and the position in m

struct Figure {
  const char* name;
  double ours, theirs, tolerance;
};

}  // namespace

std::optional<std::string> camera_mismatch(const CameraModel& calibrated, const CameraModel& announced) {
  const auto& a = calibrated;
  const auto& b = announced;
  const Vector3 p_a = a.X_WC.translation();
  const Vector3 p_b = b.X_WC.translation();
  const double turn = (a.X_WC.linear() - b.X_WC.linear()).cwiseAbs().maxCoeff();
  const std::array<Figure, 15> figures{{{"width", static_cast<double>(a.width), static_cast<double>(b.width), 0.0},
                                        {"height", static_cast<double>(a.height), static_cast<double>(b.height), 0.0},
                                        {"fx", a.fx, b.fx, kPixels},
                                        {"fy", a.fy, b.fy, kPixels},
                                        {"cx", a.cx, b.cx, kPixels},
                                        {"cy", a.cy, b.cy, kPixels},
                                        {"distortion k1", a.distortion[0], b.distortion[0], kRatio},
                                        {"distortion k2", a.distortion[1], b.distortion[1], kRatio},
                                        {"distortion p1", a.distortion[2], b.distortion[2], kRatio},
                                        {"distortion p2", a.distortion[3], b.distortion[3], kRatio},
                                        {"distortion k3", a.distortion[4], b.distortion[4], kRatio},
                                        {"p_WC x", p_a.x(), p_b.x(), kRatio},
                                        {"p_WC y", p_a.y(), p_b.y(), kRatio},
                                        {"p_WC z", p_a.z(), p_b.z(), kRatio},
                                        {"turn away from the calibrated pose", 0.0, turn, kRatio}}};
  for (const Figure& f : figures) {
    if (std::abs(f.ours - f.theirs) <= f.tolerance) continue;
    std::ostringstream text;
    text << f.name << ": found " << f.theirs << "; the calibration file says " << f.ours;
    return text.str();
  }
  return std::nullopt;
}

}  // namespace breakshot::perception
