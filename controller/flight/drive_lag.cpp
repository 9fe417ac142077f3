#include "controller/flight/drive_lag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace breakshot::control::flight {
namespace {

/// Longest delay that is looked for; drives that lag more are of no use to strokes.
constexpr Duration kLongestLag = std::chrono::milliseconds{50};
constexpr Duration kScanStep = std::chrono::milliseconds{1};
constexpr int kIterations = 8;
/// Of a joint, over all states: below this mean square speed its delay drowns in what it is off by, rad/s.
constexpr double kLeastSpeed = 0.02;
constexpr std::size_t kLeastStates = 100;

struct Knot {
  Time due;
  JointVector q, qd;
};
struct Sample {
  Time stamp;
  JointVector q;
};

/// Sums over the samples of a joint for one delay.
struct Sums {
  double error2 = 0.0, error_speed = 0.0, speed2 = 0.0;
  std::size_t count = 0;

  Sums& operator+=(const Sums& other) noexcept {
    error2 += other.error2;
    error_speed += other.error_speed;
    speed2 += other.speed2;
    count += other.count;
    return *this;
  }
  double rms() const noexcept {
    return count > 0 ? std::sqrt(error2 / static_cast<double>(count)) : std::numeric_limits<double>::infinity();
  }
  double rms_speed() const noexcept { return count > 0 ? std::sqrt(speed2 / static_cast<double>(count)) : 0.0; }
};

class Comparison {
 public:
  explicit Comparison(std::span<const TickRecord> ticks) {
    for (const TickRecord& tick : ticks) {
      if (tick.command.q.size() > 0 && (knots_.empty() || tick.command.due > knots_.back().due))
        knots_.push_back({tick.command.due, tick.command.q, tick.command.qd});
      if (tick.came && tick.motion == LoopMemory::Motion::kOnTrajectory && tick.state.q.size() == tick.command.q.size())
        samples_.push_back({tick.state.stamp, tick.state.q});
    }
  }

  std::size_t samples() const noexcept { return samples_.size(); }
  int joints() const noexcept { return samples_.empty() ? 0 : static_cast<int>(samples_.front().q.size()); }

  /// @param joint  -1: all
  Sums at(int joint, double lag_s) const noexcept {
    Sums sums;
    const Duration lag = from_seconds(lag_s);
    for (const Sample& sample : samples_) {
      const Time at = sample.stamp - lag;
      const auto after = std::upper_bound(knots_.begin(), knots_.end(), at, [](Time t, const Knot& knot) { return t < knot.due; });
      if (after == knots_.begin() || after == knots_.end()) continue;
      const Knot& a = *std::prev(after);
      const Knot& b = *after;
      if (a.q.size() != sample.q.size() || b.q.size() != sample.q.size()) continue;
      const double span = to_seconds(b.due - a.due);
      const double u = to_seconds(at - a.due) / span;
      const double v = 1.0 - u;
      for (int j = joint < 0 ? 0 : joint; j < (joint < 0 ? joints() : joint + 1); ++j) {
        const double q =
            (1.0 + 2.0 * u) * v * v * a.q[j] + u * v * v * span * a.qd[j] + u * u * (3.0 - 2.0 * u) * b.q[j] - u * u * v * span * b.qd[j];
        const double qd = v * a.qd[j] + u * b.qd[j];
        const double error = q - sample.q[j];
        sums += {error * error, error * qd, qd * qd, 1};
      }
    }
    return sums;
  }

  double best_lag(int joint) const noexcept {
    double lag = 0.0;
    double least = std::numeric_limits<double>::infinity();
    for (Duration tried{}; tried <= kLongestLag; tried += kScanStep) {
      const double rms = at(joint, to_seconds(tried)).rms();
      if (rms >= least) continue;
      least = rms;
      lag = to_seconds(tried);
    }
    for (int i = 0; i < kIterations; ++i) {
      const Sums sums = at(joint, lag);
      if (sums.speed2 > 0.0) lag = std::clamp(lag + sums.error_speed / sums.speed2, 0.0, to_seconds(kLongestLag));
    }
    return lag;
  }

 private:
  std::vector<Knot> knots_;
  std::vector<Sample> samples_;
};

}  // namespace

Result<DriveLag, std::string> find_drive_lag(std::span<const TickRecord> ticks, Duration configured) {
  const Comparison comparison{ticks};
  if (comparison.samples() < kLeastStates)
    return fmt::format("{} joint states measured on a trajectory; a delay takes {}", comparison.samples(), kLeastStates);
  const double moved = comparison.at(-1, to_seconds(configured)).rms_speed();
  if (moved < kLeastSpeed) return fmt::format("the joints moved at {:.3f} rad/s rms; a delay shows from {} rad/s", moved, kLeastSpeed);
  DriveLag found;
  const double lag = comparison.best_lag(-1);
  found.lag = from_seconds(lag);
  found.residual = comparison.at(-1, lag).rms();
  found.residual_configured = comparison.at(-1, to_seconds(configured)).rms();
  found.states = comparison.samples();
  for (int j = 0; j < comparison.joints(); ++j) {
    const bool moves = comparison.at(j, lag).rms_speed() >= kLeastSpeed;
    found.joint_lag.push_back(moves ? from_seconds(comparison.best_lag(j)) : Duration{-1});
  }
  return found;
}

}  // namespace breakshot::control::flight
