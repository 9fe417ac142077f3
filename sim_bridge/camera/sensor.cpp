#include "sim_bridge/camera/sensor.hpp"

#include "sim_bridge/camera/mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

namespace breakshot::sim_bridge {
namespace {

constexpr std::size_t kDeviates = std::size_t{1} << 17;

// Fixed point, chosen so that every product is the high half of a 16-bit multiplication, which SSE2 does eight at a time:
constexpr int kValueBits = 4;     // a colour value in 1/16
constexpr int kGainBits = 12;     // a gain in 1/4096: 2.83 (brightness 8) is 11585
constexpr int kDeviateBits = 12;  // a normal deviate in 1/4096: +-7.99 fits
constexpr int kSigmaBits = 8;     // a standard deviation in 1/256 of a colour value

/// High half of a 16-bit product; one instruction on vectors. The compiler sees that only in this plain form, without a factor at the result.
constexpr std::uint16_t multiply_high(std::uint16_t a, std::uint16_t b) {
  return static_cast<std::uint16_t>((static_cast<std::uint32_t>(a) * b) >> 16);
}
constexpr std::int16_t multiply_high(std::int16_t a, std::int16_t b) { return static_cast<std::int16_t>((a * b) >> 16); }

/// Weyl sequence and splitmix64's finaliser (Steele, Lea, Flood 2014): each input bit moves every output bit.
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

void check_range(const char* what, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw CameraError{"camera: " + std::string{what} + ": found " + std::to_string(value) + "; allowed " + std::to_string(low) + " to " +
                      std::to_string(high)};
  }
}

/// One block of colour: v = gain * ideal; sigma(v); v + deviate * sigma(v).
void expose_block(const std::uint8_t* ideal, const Sensor::BlockCoefficients& with, const std::int16_t* deviates, std::size_t count,
                  std::uint8_t* out) {
  using Signed = std::int16_t;
  using Unsigned = std::uint16_t;
  constexpr Signed kFull = 255 << kValueBits;
  for (std::size_t i = 0; i < count; ++i) {
    // 8 + 12 - 16 = 4 bits below the point.
    Signed value = static_cast<Signed>(multiply_high(static_cast<Unsigned>(ideal[i] << 8), with.gain[i]));
    value = value > kFull ? kFull : value;
    const auto x = static_cast<Unsigned>(value << 4);  // 0 to 1 as 0 to 65280
    const auto steepness = static_cast<Unsigned>(with.sigma_slope[i] + multiply_high(static_cast<Unsigned>(65280 - x), with.sigma_bow[i]));
    const auto deviation = static_cast<Signed>(with.sigma_start[i] + multiply_high(x, steepness));
    // 8 + 12 - 16 = 4 bits below the point, as the value has.
    const Signed noise = multiply_high(deviation, deviates[i]);
    auto noisy = static_cast<Signed>(static_cast<Signed>(value + noise + 8) >> kValueBits);
    noisy = noisy < 0 ? Signed{0} : noisy;
    out[i] = static_cast<std::uint8_t>(noisy > 255 ? Signed{255} : noisy);
  }
}

}  // namespace

Sensor::Sensor(const NoiseSettings& noise, std::uint64_t seed, double depth_min, double depth_max)
    : noise_{noise},
      seed_{mix(seed)},
      depth_low_{static_cast<std::int32_t>(depth_min * 1e4)},
      depth_high_{static_cast<std::int32_t>(depth_max * 1e4)},
      depth_scale_{0.0F} {
  check_range("depth_min in m", depth_min, 0.0, 6.5);
  check_range("depth_max in m", depth_max, depth_min, 6.5);
  check_range("noise.read_sigma", noise.read_sigma, 0.0, 20.0);
  check_range("noise.shot_gain", noise.shot_gain, 0.0, 1.0);
  check_range("noise.depth_subpixel in px", noise.depth_subpixel, 0.0, 2.0);
  check_range("noise.depth_focal in px", noise.depth_focal, 50.0, 10000.0);
  check_range("noise.depth_baseline in m", noise.depth_baseline, 0.005, 1.0);
  set_exposure({});

  // sigma(z) = z^2 s / (f b); z in 0.1 mm on both sides makes it a factor 1e-4.
  depth_scale_ = static_cast<float>(1e-4 * noise.depth_subpixel / (noise.depth_focal * noise.depth_baseline));

  // A parabola through the ends of sqrt(read^2 + gain I) and its value at I = 255 / 3, where it bends: within 3 % for usual settings
  // and a hundred times cheaper than a root per value. bow is x (1 - x).
  const auto exact = [&](double value) { return std::sqrt(noise.read_sigma * noise.read_sigma + noise.shot_gain * value); };
  constexpr double kMiddle = 1.0 / 3.0;
  const double start = exact(0.0), end = exact(255.0);
  const double bow = (exact(255.0 * kMiddle) - start - (end - start) * kMiddle) / (kMiddle * (1.0 - kMiddle));
  const auto fixed_point = [](double sigma) { return static_cast<std::uint16_t>(std::lround(sigma * (1 << kSigmaBits))); };
  block_.sigma_start.fill(fixed_point(start));
  block_.sigma_slope.fill(fixed_point(end - start));
  block_.sigma_bow.fill(fixed_point(bow));

  // Without noise all deviates are 0, and the same code leaves the values as they are.
  deviates_.resize(kDeviates + kBlock, 0);
  if (!noise.enabled) return;
  std::mt19937_64 random{seed_};
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < kDeviates; ++i) {
    deviates_[i] = static_cast<std::int16_t>(std::lround(std::clamp(normal(random), -7.9, 7.9) * (1 << kDeviateBits)));
  }
  std::copy_n(deviates_.begin(), kBlock, deviates_.begin() + static_cast<std::ptrdiff_t>(kDeviates));
}

void Sensor::set_exposure(const Exposure& exposure) {
  check_range("exposure.brightness", exposure.brightness, 0.0, kMaxBrightness);
  for (const double factor : exposure.white_balance) check_range("exposure.white_balance", factor, 0.0, kMaxBrightness);
  for (std::size_t i = 0; i < kBlock; ++i) {
    // Factors are of light, the image is encoded.
    const double light = std::min(exposure.brightness * exposure.white_balance[i % 3], kMaxBrightness);
    block_.gain[i] = static_cast<std::uint16_t>(std::lround(std::pow(light, 1.0 / kGamma) * (1 << kGainBits)));
  }
}

std::size_t Sensor::block_offset(std::uint64_t frame, std::uint64_t stream, std::size_t block) const noexcept {
  return mix(mix(seed_ ^ mix(2 * frame + stream)) + block) % kDeviates;
}

void Sensor::expose(std::span<const std::uint8_t> ideal, std::uint64_t frame, std::span<std::uint8_t> rgb) {
  for (std::size_t begin = 0, block = 0; begin < ideal.size(); begin += kBlock, ++block) {
    expose_block(&ideal[begin], block_, &deviates_[block_offset(frame, 0, block)], std::min(kBlock, ideal.size() - begin), &rgb[begin]);
  }
}

void Sensor::measure(std::span<const std::uint16_t> ideal, std::uint64_t frame, std::span<std::uint16_t> depth) const {
  const std::int32_t low = std::max(depth_low_, 1), high = depth_high_;
  const float scale = depth_scale_ / static_cast<float>(1 << kDeviateBits);
  for (std::size_t begin = 0, block = 0; begin < ideal.size(); begin += kBlock, ++block) {
    const std::size_t count = std::min(kBlock, ideal.size() - begin);
    const std::uint16_t* in = &ideal[begin];
    const std::int16_t* deviates = &deviates_[block_offset(frame, 1, block)];
    std::uint16_t* out = &depth[begin];
    for (std::size_t i = 0; i < count; ++i) {
      const auto z = static_cast<float>(in[i]);
      // To the nearest, by way of halves: vectors have no instruction that rounds.
      const std::int32_t noisy = (static_cast<std::int32_t>(2.0F * (z + z * z * scale * static_cast<float>(deviates[i]))) + 1) >> 1;
      out[i] = static_cast<std::uint16_t>(noisy >= low && noisy <= high ? noisy : 0);
    }
  }
}

double Sensor::colour_sigma(int value) const {
  const double x = value / 255.0;
  return (block_.sigma_start[0] + block_.sigma_slope[0] * x + block_.sigma_bow[0] * x * (1.0 - x)) / (1 << kSigmaBits);
}

}  // namespace breakshot::sim_bridge
