#include "tests/bench/perception/score.hpp"

#include "tests/bench/statistics.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace breakshot::bench {
namespace {

// Middle 95 % of chi square over its degrees of freedom (Wilson and Hilferty 1931).
Interval chi_square_band(double freedom) noexcept {
  const double spread = 2.0 / (9.0 * freedom);
  const auto at = [&](double z) { return std::pow(1.0 - spread + z * std::sqrt(spread), 3); };
  return {at(-1.959964), at(1.959964)};
}

double rms_mm(double sum2, int count) noexcept { return 1e3 * std::sqrt(sum2 / std::max(1, count)); }

}  // namespace

void Score::add(const Finding& finding, std::span<const sim_bridge::DiscState> truth) {
  ++scenes;
  foreign += static_cast<int>(finding.foreign);
  cpu_ms.push_back(finding.cpu_ms);
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> of(truth.size(), kNone);
  double scene_nees = 0.0;
  int scene_discs = 0;
  for (std::size_t i = 0; i < finding.discs.size(); ++i) {
    const FoundDisc& disc = finding.discs[i];
    const auto nearest = std::min_element(truth.begin(), truth.end(), [&](const auto& a, const auto& b) {
      return (a.p_WD - disc.p_WD).squaredNorm() < (b.p_WD - disc.p_WD).squaredNorm();
    });
    if (nearest == truth.end() || (nearest->p_WD - disc.p_WD).norm() > kMatch ||
        of[static_cast<std::size_t>(nearest - truth.begin())] != kNone) {
      ++invented;
      continue;
    }
    of[static_cast<std::size_t>(nearest - truth.begin())] = i;
    ++discs;
    const Vector2 error = disc.p_WD - nearest->p_WD;
    const double radius_error = disc.radius - nearest->radius;
    centre2 += error.squaredNorm();
    centre_max = std::max(centre_max, error.norm());
    radius2 += radius_error * radius_error;
    radius_sum += radius_error;
    radius_max = std::max(radius_max, std::abs(radius_error));
    if (verbose && (error.norm() > 0.3e-3 || std::abs(radius_error) > 0.3e-3)) {
      std::printf("  scene %d: poor at (%.4f, %.4f) m: centre off by (%.3f, %.3f) mm, radius %.1f mm by %.3f mm, sigmas %.3f and %.3f mm\n",
                  scenes, nearest->p_WD.x(), nearest->p_WD.y(), 1e3 * error.x(), 1e3 * error.y(), 1e3 * nearest->radius, 1e3 * radius_error,
                  1e3 * std::sqrt(0.5 * disc.covariance.trace()), 1e3 * disc.radius_sigma);
    }
    if (!disc.has_covariance) continue;
    ++scene_discs;
    scene_nees += error.dot(disc.covariance.inverse() * error);
    radius_nees_ += std::pow(radius_error / disc.radius_sigma, 2);
  }
  for (std::size_t t = 0; t < truth.size() && verbose; ++t) {
    if (of[t] != kNone) continue;
    std::printf("  scene %d: missed colour %d, radius %.1f mm, at (%.4f, %.4f) m\n", scenes, truth[t].colour, 1e3 * truth[t].radius,
                truth[t].p_WD.x(), truth[t].p_WD.y());
  }
  missed += static_cast<int>(std::count(of.begin(), of.end(), kNone));
  if (scene_discs > 0) {
    nees_ += scene_nees;
    with_covariance_ += scene_discs;
    ++scenes_with_covariance_;
    const Interval band = chi_square_band(2.0 * scene_discs);
    const double ratio = scene_nees / (2.0 * scene_discs);
    scenes_in_band_ += ratio >= band.low && ratio <= band.high ? 1 : 0;
  }

  for (std::size_t a = 0; a < truth.size(); ++a) {
    for (std::size_t b = a + 1; b < truth.size(); ++b) {
      const double gap = (truth[a].p_WD - truth[b].p_WD).norm() - truth[a].radius - truth[b].radius;
      const bool both = of[a] != kNone && of[b] != kNone;
      const std::pair<std::size_t, std::size_t> pair = std::minmax(of[a], of[b]);
      const bool called = both && std::find(finding.touching.begin(), finding.touching.end(), pair) != finding.touching.end();
      const bool clear = std::abs(gap - kTouch) > kClear;
      if (gap < kTouch) {
        ++(called ? tp_ : fn_);
        fn_clear_ += !called && clear ? 1 : 0;
      } else if (called) {
        ++fp_;
        fp_clear_ += clear ? 1 : 0;
        false_contacts += gap >= kFar ? 1 : 0;
      }
      if (gap > 0.010 || !both) continue;
      const FoundDisc& disc_a = finding.discs[of[a]];
      const FoundDisc& disc_b = finding.discs[of[b]];
      const double error = (disc_a.p_WD - disc_b.p_WD).norm() - disc_a.radius - disc_b.radius - gap;
      ++gaps;
      gap2 += error * error;
      gap_sum += error;
      gap_max = std::max(gap_max, std::abs(error));
      const Vector2 n_AB = (disc_b.p_WD - disc_a.p_WD).normalized();
      const double variance =
          n_AB.dot((disc_a.covariance + disc_b.covariance) * n_AB) + std::pow(disc_a.radius_sigma, 2) + std::pow(disc_b.radius_sigma, 2);
      if (disc_a.has_covariance && disc_b.has_covariance) gap_nees += error * error / variance;
    }
  }
}

double Score::f1() const noexcept { return 2.0 * tp_ / std::max(1, 2 * tp_ + fp_ + fn_); }

nlohmann::json Score::metrics() const {
  nlohmann::json out{{"scenes", scenes},
                     {"discs", discs},
                     {"missed", missed},
                     {"invented", invented},
                     {"foreign", foreign},
                     {"centre_rms_mm", rms_mm(centre2, discs)},
                     {"centre_max_mm", 1e3 * centre_max},
                     {"radius_rms_mm", rms_mm(radius2, discs)},
                     {"radius_max_mm", 1e3 * radius_max},
                     {"radius_bias_mm", 1e3 * radius_sum / std::max(1, discs)},
                     {"gap_rms_mm", rms_mm(gap2, gaps)},
                     {"gap_max_mm", 1e3 * gap_max},
                     {"gap_bias_mm", 1e3 * gap_sum / std::max(1, gaps)},
                     {"touch_f1", f1()},
                     {"touch_f1_clear", 2.0 * tp_ / std::max(1, 2 * tp_ + fp_clear_ + fn_clear_)},
                     {"false_contacts", false_contacts},
                     {"touching_pairs", tp_ + fn_},
                     {"frame_ms_median", quantile(cpu_ms, 0.5)},
                     {"frame_ms_max", quantile(cpu_ms, 1.0)}};
  if (with_covariance_ > 0) {
    const Interval band = chi_square_band(2.0 * with_covariance_);
    out["nees"] = nees_ / with_covariance_;
    out["nees_band"] = {2.0 * band.low, 2.0 * band.high};
    out["nees_in_band"] = nees_ / with_covariance_ >= 2.0 * band.low && nees_ / with_covariance_ <= 2.0 * band.high;
    out["scenes_in_nees_band"] = static_cast<double>(scenes_in_band_) / scenes_with_covariance_;
    out["radius_nees"] = radius_nees_ / with_covariance_;
    out["gap_nees"] = gap_nees / std::max(1, gaps);
  }
  return out;
}

void Score::print_head() {
  std::printf("%-14s %-7s %6s %6s %5s | %6s %6s | %6s %6s | %6s %6s | %6s %6s %6s | %5s %5s %5s %5s | %6s\n", "lighting", "method", "discs",
              "missed", "inv.", "centre", "max", "radius", "max", "gap", "max", "F1", "clear", "false", "NEES", "band", "rad.", "gap",
              "ms");
}

void Score::print_row(const std::string& lighting, const std::string& method) const {
  const nlohmann::json m = metrics();
  const auto number = [&](const char* key) { return m[key].get<double>(); };
  std::printf("%-14s %-7s %6d %6d %5d | %6.3f %6.3f | %6.3f %6.3f | %6.3f %6.3f | %6.3f %6.3f %6d |", lighting.c_str(), method.c_str(),
              discs + missed, missed, invented, number("centre_rms_mm"), number("centre_max_mm"), number("radius_rms_mm"),
              number("radius_max_mm"), number("gap_rms_mm"), number("gap_max_mm"), number("touch_f1"), number("touch_f1_clear"),
              false_contacts);
  if (m.contains("nees")) {
    std::printf(" %5.2f %5.2f %5.2f %5.2f |", number("nees"), number("scenes_in_nees_band"), number("radius_nees"), number("gap_nees"));
  } else {
    std::printf(" %5s %5s %5s %5s |", "-", "-", "-", "-");
  }
  std::printf(" %6.2f\n", number("frame_ms_median"));
}

}  // namespace breakshot::bench
