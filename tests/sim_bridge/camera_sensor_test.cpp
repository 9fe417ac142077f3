#include "sim_bridge/camera/sensor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

constexpr std::size_t kPixels = 640 * 360;

struct Statistics {
  double mean = 0.0, sigma = 0.0;
};

template <typename Value>
Statistics statistics(const std::vector<Value>& values, std::size_t first = 0, std::size_t step = 1) {
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (std::size_t i = first; i < values.size(); i += step, ++count) {
    sum += values[i];
    squares += static_cast<double>(values[i]) * values[i];
  }
  const double mean = sum / count;
  return {mean, std::sqrt(squares / count - mean * mean)};
}

std::vector<std::uint8_t> exposed(Sensor& sensor, int value, std::uint64_t frame) {
  const std::vector<std::uint8_t> ideal(3 * kPixels, static_cast<std::uint8_t>(value));
  std::vector<std::uint8_t> rgb(ideal.size());
  sensor.expose(ideal, frame, rgb);
  return rgb;
}

/// Correlation of two sequences about their means.
template <typename Value>
double correlation(const std::vector<Value>& a, const std::vector<Value>& b, std::size_t shift) {
  const Statistics in_a = statistics(a), in_b = statistics(b);
  double sum = 0.0;
  for (std::size_t i = 0; i + shift < a.size(); ++i) sum += (a[i] - in_a.mean) * (b[i + shift] - in_b.mean);
  return sum / static_cast<double>(a.size() - shift) / (in_a.sigma * in_b.sigma);
}

TEST(CameraSensor, ColourNoiseIsShotPlusReadNoise) {
  const NoiseSettings noise;
  Sensor sensor{noise, 5, 0.1, 6.0};
  for (const int value : {10, 40, 85, 128, 200, 245}) {
    const double formula = std::sqrt(noise.read_sigma * noise.read_sigma + noise.shot_gain * value);
    EXPECT_NEAR(sensor.colour_sigma(value), formula, 0.03 * formula) << "curve at " << value;
    const Statistics seen = statistics(exposed(sensor, value, 1));
    EXPECT_NEAR(seen.mean, value, 0.05) << value;
    EXPECT_NEAR(seen.sigma, std::sqrt(formula * formula + 1.0 / 12.0), 0.04 * formula) << "with rounding, at " << value;
  }
}

TEST(CameraSensor, WithoutNoiseAndAtReferenceNothingChanges) {
  NoiseSettings noise;
  noise.enabled = false;
  Sensor sensor{noise, 5, 0.0, 6.5};
  std::vector<std::uint8_t> ideal(256 * 3), rgb(ideal.size());
  std::iota(ideal.begin(), ideal.end(), std::uint8_t{0});
  sensor.expose(ideal, 9, rgb);
  EXPECT_EQ(rgb, ideal);
  std::vector<std::uint16_t> far(65'000), depth(far.size());
  std::iota(far.begin(), far.end(), std::uint16_t{0});
  sensor.measure(far, 9, depth);
  EXPECT_EQ(depth, far);
}

TEST(CameraSensor, DepthNoiseGrowsWithTheSquareOfDepth) {
  const NoiseSettings noise;
  const Sensor sensor{noise, 5, 0.1, 6.0};
  for (const double z : {0.3, 0.8, 1.6}) {
    const std::vector<std::uint16_t> ideal(kPixels, static_cast<std::uint16_t>(1e4 * z));
    std::vector<std::uint16_t> depth(kPixels);
    sensor.measure(ideal, 3, depth);
    const double formula = 1e4 * z * z * noise.depth_subpixel / (noise.depth_focal * noise.depth_baseline);
    const Statistics seen = statistics(depth);
    EXPECT_NEAR(seen.mean, 1e4 * z, 0.02 * formula + 0.1) << z;
    EXPECT_NEAR(seen.sigma, std::sqrt(formula * formula + 1.0 / 12.0), 0.02 * formula) << z;
  }
}

TEST(CameraSensor, WhatIsOutOfRangeIsNotMeasured) {
  const Sensor sensor{{}, 5, 0.28, 3.0};
  const std::vector<std::uint16_t> ideal{0, 1000, 2000, 40000, 65535};
  std::vector<std::uint16_t> depth(ideal.size(), 7);
  sensor.measure(ideal, 3, depth);
  EXPECT_EQ(depth, std::vector<std::uint16_t>(ideal.size(), 0));
}

TEST(CameraSensor, NoiseIsUncorrelatedInSpaceTimeAndBetweenStreams) {
  Sensor sensor{{}, 5, 0.1, 6.0};
  const auto first = exposed(sensor, 120, 1), second = exposed(sensor, 120, 2);
  const double bound = 5.0 / std::sqrt(static_cast<double>(first.size()));
  for (const std::size_t shift : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{240}, std::size_t{1920}}) {
    EXPECT_LT(std::abs(correlation(first, first, shift)), bound) << "neighbours at " << shift;
  }
  EXPECT_LT(std::abs(correlation(first, second, 0)), bound) << "from frame to frame";
  Sensor other{{}, 6, 0.1, 6.0};
  EXPECT_LT(std::abs(correlation(first, exposed(other, 120, 1), 0)), bound) << "from seed to seed";
}

TEST(CameraSensor, SameFrameSameNoise) {
  Sensor a{{}, 5, 0.1, 6.0}, b{{}, 5, 0.1, 6.0};
  exposed(b, 30, 77);
  EXPECT_EQ(exposed(a, 120, 4), exposed(b, 120, 4));
}

TEST(CameraSensor, ExposureScalesLightAndClips) {
  NoiseSettings noise;
  noise.enabled = false;
  Sensor sensor{noise, 5, 0.1, 6.0};
  // Values are encoded with exponent 2: a quarter of the light is half the value.
  sensor.set_exposure({0.25, {1.0, 1.0, 1.0}});
  EXPECT_NEAR(statistics(exposed(sensor, 120, 1)).mean, 60.0, 0.51);
  sensor.set_exposure({0.0, {1.0, 1.0, 1.0}});
  EXPECT_EQ(statistics(exposed(sensor, 250, 1)).mean, 0.0);
  sensor.set_exposure({4.0, {1.0, 0.25, 4.0}});
  const auto tinted = exposed(sensor, 100, 1);
  EXPECT_NEAR(statistics(tinted, 0, 3).mean, 200.0, 0.51);
  EXPECT_NEAR(statistics(tinted, 1, 3).mean, 100.0, 0.51);
  EXPECT_EQ(statistics(tinted, 2, 3).mean, 255.0);
  EXPECT_THROW(sensor.set_exposure({-1.0, {1.0, 1.0, 1.0}}), CameraError);
  EXPECT_THROW(sensor.set_exposure({1.0, {1.0, std::nan(""), 1.0}}), CameraError);
  EXPECT_THROW(sensor.set_exposure({kMaxBrightness * 1.01, {1.0, 1.0, 1.0}}), CameraError);
}

TEST(CameraSensor, RefusesSettingsOutOfRange) {
  NoiseSettings noise;
  noise.read_sigma = -1.0;
  EXPECT_THROW(Sensor(noise, 1, 0.1, 6.0), CameraError);
  EXPECT_THROW(Sensor({}, 1, 2.0, 1.0), CameraError);
  EXPECT_THROW(Sensor({}, 1, 0.1, 7.0), CameraError);
}

}  // namespace
}  // namespace breakshot::sim_bridge
