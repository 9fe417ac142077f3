#include "controller/motion/path_stop.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <random>

namespace breakshot::motion {
namespace {

constexpr int kJoints = 6;
constexpr double kTick = 1e-3;

/// Every joint swings as A sin^2(w t / 2 + phase) within the limits that strokes keep: pi rad/s, 10 rad/s^2, 200 rad/s^3.
std::unique_ptr<Trajectory> swinging(std::mt19937& random) {
  auto trajectory = std::make_unique<Trajectory>();
  trajectory->joints = kJoints;
  trajectory->size = 3000;
  trajectory->tick = std::chrono::milliseconds{1};
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto uniform = [&](double low, double high) { return std::uniform_real_distribution{low, high}(random); };
    const double w = uniform(1.0, 12.0);
    const double amplitude = std::min({3.1 / w, 9.9 / (w * w), 199.0 / (w * w * w)});
    const double phase = uniform(0.0, 6.28);
    for (std::size_t k = 0; k < trajectory->size; ++k) {
      const double x = w * kTick * static_cast<double>(k) + phase;
      trajectory->points[k].q[j] = amplitude * std::sin(x);
      trajectory->points[k].qd[j] = amplitude * w * std::cos(x);
      trajectory->points[k].qdd[j] = -amplitude * w * w * std::sin(x);
    }
  }
  return trajectory;
}

TEST(PathStop, KeepsLimitsAndPathAndStopsInTime) {
  std::mt19937 random{1};
  const StopLimits limits;
  Duration longest{};
  for (int i = 0; i < 300; ++i) {
    const auto trajectory = swinging(random);
    const std::size_t tick = std::uniform_int_distribution<std::size_t>{0, 1500}(random);
    PathStop stop{limits};
    stop.start(*trajectory, tick);
    longest = std::max(longest, stop.duration());

    TrajectoryPoint before = trajectory->points[tick];
    TrajectoryPoint now;
    bool moving = true;
    int steps = 0;
    while (moving) {
      moving = stop.step(now);
      ASSERT_LT(++steps, 2000);
      for (std::size_t j = 0; j < kJoints; ++j) {
        EXPECT_LE(std::abs(now.qdd[j]), 1.02 * limits.acceleration);
        EXPECT_LE(std::abs(now.qdd[j] - before.qdd[j]) / kTick, 1.05 * limits.jerk);
        // Speed is the derivative of position and acceleration that of speed.
        EXPECT_NEAR(now.q[j] - before.q[j], 0.5 * kTick * (now.qd[j] + before.qd[j]), 1e-7);
        EXPECT_NEAR(now.qd[j] - before.qd[j], 0.5 * kTick * (now.qdd[j] + before.qdd[j]), 1e-4);
        // On the path: between the two points of the trajectory that enclose the path position.
        const auto at = static_cast<std::size_t>(stop.path_position());
        EXPECT_NEAR(now.q[j], trajectory->points[at].q[j], 3.2 * kTick);
      }
      before = now;
    }
    for (std::size_t j = 0; j < kJoints; ++j) {
      EXPECT_EQ(now.qd[j], 0.0);
      EXPECT_EQ(now.qdd[j], 0.0);
    }
    TrajectoryPoint after;
    EXPECT_FALSE(stop.step(after));
    EXPECT_EQ(after.q, now.q);
  }
  RecordProperty("longest_ms", static_cast<int>(longest.count() / 1'000'000));
  EXPECT_LE(longest, std::chrono::milliseconds{300});
}

TEST(PathStop, AtRestStaysAtRest) {
  auto trajectory = std::make_unique<Trajectory>();
  trajectory->joints = kJoints;
  trajectory->size = 10;
  trajectory->tick = std::chrono::milliseconds{1};
  for (auto& point : trajectory->points) point.q = {1, 2, 3, 4, 5, 6};
  PathStop stop;
  TrajectoryPoint out;
  EXPECT_FALSE(stop.step(out));  // never started
  stop.start(*trajectory, 99);   // past the end counts as the last tick
  EXPECT_FALSE(stop.step(out));
  EXPECT_EQ(stop.duration(), Duration{0});
  EXPECT_EQ(out.q, trajectory->points[0].q);
}

}  // namespace
}  // namespace breakshot::motion
