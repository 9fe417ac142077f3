#include "perception/rim_circle.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>

namespace breakshot::perception {
namespace {

constexpr double kTukey = 4.685;  // 95 % efficiency for normal errors (Holland and Welsch 1977)
constexpr double kPatches = 8.0;  // of an outline that share one draw of SharedErrors::patch
constexpr int kRounds = 4;        // the errors are small, so two or three settle it

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::optional<RimCircle> fit_circle(std::vector<Edge>& edges, double radius, int directions, const SharedErrors& errors) {
  using Vector4 = Eigen::Vector4d;  // centre, radius, and what the foot is shifted by
  using Matrix4 = Eigen::Matrix4d;
  const auto row_of = [](const Edge& e) { return Vector4{e.n_W.x(), e.n_W.y(), 1.0, e.foot ? 1.0 : 0.0}; };
  // Edges that share an error count as one. All around an outline such errors mostly cancel, as the pixel grid's do; what an arc leaves of them grows with
  // what is missing.
  const double missing = 1.0 - static_cast<double>(edges.size()) / directions;
  const double patch2 = (errors.patch * errors.patch + missing * missing * errors.arc * errors.arc) * directions / kPatches;
  std::vector<double> distances;
  distances.reserve(edges.size());
  Vector4 x{0.0, 0.0, radius, 0.0};
  double variance = 0.0;
  Matrix4 normal{Matrix4::Zero()};
  for (int round = 0; round < kRounds; ++round) {
    distances.clear();
    for (const Edge& e : edges) distances.push_back(std::abs(e.range - row_of(e).dot(x)));
    const double sigma = std::max(1.4826 * median(distances), errors.floor);
    variance = sigma * sigma + patch2;
    normal.setZero();
    Vector4 right = Vector4::Zero();
    for (Edge& e : edges) {
      const Vector4 row = row_of(e);
      const double error = (e.range - row.dot(x)) / (kTukey * sigma);
      const double inside = 1.0 - error * error;
      e.weight = inside > 0.0 ? inside * inside : 0.0;
      normal += e.trust * e.weight * row * row.transpose();
      right += e.trust * e.weight * e.range * row;
    }
    normal(3, 3) += variance / (errors.foot * errors.foot);
    const auto solver = normal.ldlt();
    if (solver.rcond() < 1e-6) return std::nullopt;
    x = solver.solve(right);
  }
  return RimCircle{x.head<3>(), variance * normal.inverse().topLeftCorner<3, 3>()};
}

Vector3 circle_of_most(const std::vector<Edge>& edges, double tolerance) {
  const std::size_t n = edges.size();
  Vector3 best = Vector3::Zero();
  std::ptrdiff_t most = 0;
  for (const std::size_t share : {12, 8, 5, 3}) {
    const std::size_t step = std::max<std::size_t>(1, n / share);
    for (std::size_t first = 0; first < n; first += 3) {
      Matrix3 rows;
      Vector3 ranges;
      for (int i = 0; i < 3; ++i) {
        const auto& edge = edges[(first + static_cast<std::size_t>(i) * step) % n];
        rows.row(i) << edge.n_W.x(), edge.n_W.y(), 1.0;
        ranges[i] = edge.range;
      }
      if (std::abs(rows.determinant()) < 1e-3) continue;
      const Vector3 x = rows.inverse() * ranges;
      const auto agree = std::count_if(edges.begin(), edges.end(), [&](const auto& edge) { return std::abs(edge.error(x)) < tolerance; });
      if (agree <= most) continue;
      most = agree;
      best = x;
    }
  }
  return best;
}

}  // namespace breakshot::perception
