#include "perception/circle_moments.hpp"

#include <algorithm>

namespace breakshot::perception {

std::optional<Circle> CircleMoments::fit(double& rms) const noexcept {
  if (n < 3.0) return std::nullopt;
  // Central moments about the mean; w = u^2 + v^2 with u, v from the mean, so that mean(u) = mean(v) = 0.
  const double mx = x / n, my = y / n, m2 = mx * mx + my * my;
  const double uu = xx / n - mx * mx, vv = yy / n - my * my, uv = xy / n - mx * my;
  const double w = uu + vv;
  // z = w + 2 (mx u + my v) + m2.
  const double uw = xz / n - mx * (xx + yy) / n - 2.0 * (mx * uu + my * uv);
  const double vw = yz / n - my * (xx + yy) / n - 2.0 * (mx * uv + my * vv);
  const double zz_mean = zz / n;
  const double ww = zz_mean - 4.0 * (mx * uw + my * vw) - 4.0 * (mx * mx * uu + 2.0 * mx * my * uv + my * my * vv) - 2.0 * m2 * w - m2 * m2;

  // Newton's method on Taubin's characteristic polynomial from 0 finds its smallest root (Chernov, Circular and Linear Regression, 5.10).
  const double cov = uu * vv - uv * uv;
  const double var = ww - w * w;
  const double a3 = 4.0 * w, a2 = -3.0 * w * w - ww;
  const double a1 = var * w + 4.0 * cov * w - uw * uw - vw * vw;
  const double a0 = uw * (uw * vv - vw * uv) + vw * (vw * uu - uw * uv) - var * cov;
  double root = 0.0;
  for (int i = 0; i < 20; ++i) {
    const double slope = a1 + root * (2.0 * a2 + 3.0 * a3 * root);
    if (slope == 0.0) break;
    const double next = root - (a0 + root * (a1 + root * (a2 + root * a3))) / slope;
    if (!std::isfinite(next) || std::abs(next - root) <= 1e-12 * std::abs(next)) break;
    root = next;
  }
  const double det = root * root - root * w + cov;
  if (!(std::abs(det) > 1e-6 * w * w)) return std::nullopt;
  const double cu = (uw * (vv - root) - vw * uv) / (2.0 * det), cv = (vw * (uu - root) - uw * uv) / (2.0 * det);
  Circle circle;
  circle.p_WD = {cu + mx, cv + my};
  const double r2 = cu * cu + cv * cv + w;
  circle.radius = std::sqrt(r2);
  // Mean of (distance^2 - r^2)^2, which is (2 r error)^2 for errors that are small beside r: with f = w_i - 2 (c . u_i) - w.
  const double square = var + 4.0 * (cu * cu * uu + 2.0 * cu * cv * uv + cv * cv * vv) - 4.0 * (cu * uw + cv * vw);
  rms = std::sqrt(std::max(0.0, square)) / (2.0 * circle.radius);
  return circle;
}

}  // namespace breakshot::perception
