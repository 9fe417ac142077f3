#include "sim_bridge/camera/changing_light.hpp"

#include "common/random.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace breakshot::sim_bridge {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
/// How far from W's origin the band still shades what the camera sees, beside its own width, m.
constexpr double kBeyondView = 0.7;
/// So that phases have nothing to do with the seed's other uses.
constexpr std::uint64_t kDriftStream = 0xd81f7U, kShadowStream = 0x5ad0U;

void check_range(const char* what, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw CameraError{std::string{"camera: "} + what + ": found " + std::to_string(value) + "; allowed " + std::to_string(low) + " to " +
                      std::to_string(high)};
  }
}

/// To 1 and back in one turn, straight.
double triangle(double turns) {
  const double part = turns - std::floor(turns);
  return part < 0.5 ? 2.0 * part : 2.0 - 2.0 * part;
}

}  // namespace

Drift::Drift(const DriftSettings& settings, std::uint64_t seed) : settings_{settings}, red_phase_{0.0}, blue_phase_{0.0} {
  check_range("drift.brightness_ramp", settings.brightness_ramp, 0.01, 100.0);
  check_range("drift.brightness_ramp_time in s", settings.brightness_ramp_time, 0.1, 3600.0);
  check_range("drift.white_balance", settings.white_balance, 0.0, 0.5);
  check_range("drift.white_balance_period in s", settings.white_balance_period, 0.1, 3600.0);
  SplitMix64 random{seed ^ kDriftStream};
  red_phase_ = random.uniform();
  blue_phase_ = random.uniform();
}

Exposure Drift::at(Exposure exposure, Time time) const {
  const double t = to_seconds(time.time_since_epoch());
  const double ramp = triangle(t / (2.0 * settings_.brightness_ramp_time));
  exposure.brightness = std::min(exposure.brightness * (1.0 + (settings_.brightness_ramp - 1.0) * ramp), kMaxBrightness);
  const auto swing = [&](double& factor, double phase) {
    factor =
        std::min(factor * (1.0 + settings_.white_balance * std::sin(kTurn * (t / settings_.white_balance_period + phase))), kMaxBrightness);
  };
  swing(exposure.white_balance[0], red_phase_);
  swing(exposure.white_balance[2], blue_phase_);
  return exposure;
}

MovingShadow::MovingShadow(const MovingShadowSettings& settings, const Light& light, const Projector& projector, std::uint64_t seed)
    : settings_{settings},
      along_{std::cos(settings.direction), std::sin(settings.direction)},
      reach_{kBeyondView + 0.5 * settings.width + settings.edge},
      phase_{SplitMix64{seed ^ kShadowStream}.uniform()},
      width_{projector.model().width},
      columns_{width_ / kStep + 2} {
  check_range("moving_shadow.depth", settings.depth, 0.0, 1.0);
  check_range("moving_shadow.width in m", settings.width, 0.0, 2.0);
  check_range("moving_shadow.edge in m", settings.edge, 0.01, 1.0);
  check_range("moving_shadow.speed in m/s", settings.speed, 0.0, 5.0);
  check_range("moving_shadow.direction in rad", settings.direction, -kTurn, kTurn);
  if (!active()) return;
  Vector3 lamps = Vector3::Zero();
  for (const Lamp& lamp : light.lamps) lamps += lamp.level;
  const int rows = projector.model().height / kStep + 2;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns_; ++column) {
      Node node;
      node.p_W = projector.table_point({1.0 * kStep * column, 1.0 * kStep * row});
      const Vector3 here = lamps / (1.0 + 0.45 * node.p_W.squaredNorm());  // key_falloff() in shaders.hpp
      const Vector3 share = here.cwiseQuotient((here + light.ambient).cwiseMax(1e-9));
      node.lamp_share = {static_cast<float>(share.x()), static_cast<float>(share.y()), static_cast<float>(share.z())};
      nodes_.push_back(node);
    }
  }
  factors_.resize(nodes_.size());
  row_.resize(static_cast<std::size_t>(columns_));
}

double MovingShadow::place(Time time) const {
  const double turns = to_seconds(time.time_since_epoch()) * settings_.speed / (4.0 * reach_) + phase_;
  return reach_ * (2.0 * triangle(turns) - 1.0);
}

double MovingShadow::taken(const Vector2& p_W, Time time) const {
  const double outside = std::abs(p_W.dot(along_) - place(time)) - 0.5 * settings_.width;
  const double t = std::clamp(1.0 - outside / settings_.edge, 0.0, 1.0);
  return settings_.depth * t * t * (3.0 - 2.0 * t);
}

void MovingShadow::find_factors(Time time) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const auto share = static_cast<float>(taken(nodes_[i].p_W, time));
    for (std::size_t c = 0; c < 3; ++c) {
      factors_[i][c] =
          static_cast<std::uint32_t>(std::lround(static_cast<float>(kFull) * std::sqrt(1.0F - share * nodes_[i].lamp_share[c])));
    }
  }
}

void MovingShadow::cast(std::span<const std::uint8_t> rgb, Time time, std::span<std::uint8_t> shaded) {
  find_factors(time);
  constexpr Factor kUntouched{kFull, kFull, kFull};
  constexpr std::uint32_t kCell = kStep;
  const auto columns = static_cast<std::size_t>(columns_);
  const std::size_t stride = 3 * static_cast<std::size_t>(width_);
  for (std::size_t y = 0; y < rgb.size() / stride; ++y) {
    const Factor* above = &factors_[y / kCell * columns];
    const Factor* below = above + columns;
    const auto down = static_cast<std::uint32_t>(y % kCell);
    for (std::size_t i = 0; i < columns; ++i) {
      for (std::size_t c = 0; c < 3; ++c) row_[i][c] = ((kCell - down) * above[i][c] + down * below[i][c] + kCell / 2) / kCell;
    }
    const std::uint8_t* in = &rgb[y * stride];
    std::uint8_t* out = &shaded[y * stride];
    for (std::size_t cell = 0; cell * kCell < static_cast<std::size_t>(width_); ++cell) {
      const Factor &left = row_[cell], &right = row_[cell + 1];
      const std::size_t begin = cell * kCell, end = std::min(begin + kCell, static_cast<std::size_t>(width_));
      if (left == kUntouched && right == kUntouched) {
        std::copy(in + 3 * begin, in + 3 * end, out + 3 * begin);
        continue;
      }
      for (std::size_t x = begin; x < end; ++x) {
        const auto across = static_cast<std::uint32_t>(x - begin);
        for (std::size_t c = 0; c < 3; ++c) {
          const std::uint32_t factor = (kCell - across) * left[c] + across * right[c];  // kCell * kFull, 2^19, is 1
          out[3 * x + c] = static_cast<std::uint8_t>((in[3 * x + c] * factor + (1U << 18U)) >> 19U);
        }
      }
    }
  }
}

}  // namespace breakshot::sim_bridge
