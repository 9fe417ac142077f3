// Where a line crosses a rim, and the circle through such places.

#include "perception/rim_circle.hpp"
#include "perception/rim_edge.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace breakshot::perception {
namespace {

const std::array<float, 256> kLight = [] {
  std::array<float, 256> light{};
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = static_cast<float>(i);
  return light;
}();

const RgbLight kPaint{200.0F, 30.0F, 30.0F}, kTable{180.0F, 178.0F, 170.0F};

// How the light changes along the line, relative, per px; a factor on the paint; and the image of a lamp in it, growing outwards, per px.
struct Shade {
  double inside = 0.0, outside = 0.0, brightness = 1.0, glare = 0.0;
};

// A straight edge at x = `edge` px between paint on the left and table, as a sensor of square pixels sees it.
cv::Mat3b picture(double edge, const Shade& shade) {
  cv::Mat3b rgb(16, 16);
  for (int x = 0; x < rgb.cols; ++x) {
    const double table = std::clamp(x + 0.5 - edge, 0.0, 1.0);
    // Each side's light where it is in this pixel: in the middle of its part of it.
    const double paint_at = x - 0.5 * table - edge, table_at = x + 0.5 * (1.0 - table) - edge;
    const double mirrored = (1.0 - table) * shade.glare * std::max(0.0, paint_at + 4.0);
    const RgbLight colour = kPaint * static_cast<float>((1.0 - table) * shade.brightness * (1.0 + shade.inside * paint_at)) +
                            kTable * static_cast<float>(mirrored) + kTable * static_cast<float>(table * (1.0 + shade.outside * table_at));
    for (int y = 0; y < rgb.rows; ++y) {
      for (int c = 0; c < 3; ++c) rgb(y, x)[c] = static_cast<std::uint8_t>(std::lround(std::clamp(colour[c], 0.0F, 255.0F)));
    }
  }
  return rgb;
}

// What is measured of an edge, from an origin near it, px.
double worst_error(Rim rim, const Shade& shade) {
  double worst = 0.0;
  for (double edge = 7.0; edge < 8.0; edge += 0.1) {
    const cv::Mat3b rgb = picture(edge, shade);
    const double origin = edge + 0.15;
    const auto found = measure_edge(RimLine{rgb, kLight, {origin, 8.3}, {1.0, 0.0}}, rim, 1.0F);
    if (!found) return 99.0;
    worst = std::max(worst, std::abs(origin + found->at - edge));
  }
  return worst;
}

TEST(RimEdge, IsFoundToAFiftiethOfAPixelBetweenEvenSides) {
  EXPECT_LT(worst_error(Rim::kTop, {}), 0.02);
  EXPECT_LT(worst_error(Rim::kFoot, {}), 0.02);
}

// A bevel that a lamp from one side brightens or darkens by a quarter over the width of the edge.
TEST(RimEdge, OfATopFaceStaysWhereItIsWhenTheFaceIsShaded) {
  for (const double slope : {-0.08, 0.08}) EXPECT_LT(worst_error(Rim::kTop, {slope, 0.0, 1.0}), 0.02) << slope;
  EXPECT_LT(worst_error(Rim::kTop, {0.0, 0.0, 0.5}), 0.02);
}

// The table darkens towards a wall; so does the wall towards the table, and neither as the other.
TEST(RimEdge, GoesAlongWithTheSlopeOfTheSideThatItIsToldBy) {
  EXPECT_LT(worst_error(Rim::kTop, {0.0, 0.05, 1.0}), 0.04);
  EXPECT_LT(worst_error(Rim::kFoot, {-0.05, 0.0, 1.0}), 0.04);
  EXPECT_LT(worst_error(Rim::kFoot, {0.0, 0.10, 1.0}), 0.02);
}

// The image of a lamp takes the paint's hue towards the table's.
TEST(RimEdge, BesideTheImageOfALampIsCorrectedAndTrustedLess) {
  const Shade shade{0.0, 0.0, 0.7, 0.03};
  EXPECT_LT(worst_error(Rim::kTop, shade), 0.05);
  const cv::Mat3b rgb = picture(7.5, shade);
  EXPECT_LT(measure_edge(RimLine{rgb, kLight, {7.5, 8.0}, {1.0, 0.0}}, Rim::kTop, 1.0F)->trust, 0.8);
}

TEST(RimEdge, TrustsClippedPaintLess) {
  const auto trust = [](double brightness) {
    const cv::Mat3b rgb = picture(7.5, {0.0, 0.0, brightness});
    return measure_edge(RimLine{rgb, kLight, {7.5, 8.0}, {1.0, 0.0}}, Rim::kTop, 1.0F)->trust;
  };
  EXPECT_GT(trust(1.0), 0.95);
  EXPECT_LT(trust(1.4), 0.75);
}

TEST(RimEdge, IsNotInventedOnOneColour) {
  const cv::Mat3b rgb(16, 16, cv::Vec3b{180, 178, 170});
  EXPECT_FALSE(measure_edge(RimLine{rgb, kLight, {7.5, 8.0}, {1.0, 0.0}}, Rim::kTop, 1.0F));
  EXPECT_FALSE(find_edge(RimLine{rgb, kLight, {7.5, 8.0}, {1.0, 0.0}}, Rim::kTop, kMaxReach, 1.0F));
}

constexpr int kDirections = 144;
constexpr SharedErrors kErrors{50e-6, 10e-6, 50e-6};

// Edges of a circle of 30 mm about (0.1, -0.2) mm, of which `tops` directions in a row show the top rim, the rest the foot, which is shifted.
std::vector<Edge> outline(int tops, double foot_shift, double noise, std::uint32_t seed = 1) {
  std::mt19937 random{seed};
  std::normal_distribution<double> normal{0.0, noise};
  std::vector<Edge> edges;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kDirections;
    Edge edge;
    edge.n_W = {std::cos(angle), std::sin(angle)};
    edge.foot = k >= tops;
    edge.range = 30e-3 + edge.n_W.dot(Vector2{0.1e-3, -0.2e-3}) + (edge.foot ? foot_shift : 0.0) + normal(random);
    edges.push_back(edge);
  }
  return edges;
}

TEST(RimCircle, IsNotPulledByADarkLineAtTheFoot) {
  std::vector<Edge> edges = outline(100, 100e-6, 0.0);
  const auto circle = fit_circle(edges, 30e-3, kDirections, kErrors);
  ASSERT_TRUE(circle);
  EXPECT_LT((circle->x.head<2>() - Vector2{0.1e-3, -0.2e-3}).norm(), 12e-6);
  EXPECT_NEAR(circle->x.z(), 30e-3, 12e-6);
}

TEST(RimCircle, CovarianceIsThatOfItsErrors) {
  for (const int tops : {144, 90, 60}) {
    double nees = 0.0;
    constexpr int kTrials = 400;
    std::mt19937 random{7};
    std::normal_distribution<double> shift{0.0, kErrors.foot};
    for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
      std::vector<Edge> edges = outline(tops, shift(random), 60e-6, trial);
      const auto circle = fit_circle(edges, 30e-3, kDirections, {50e-6, 0.0, kErrors.foot});
      ASSERT_TRUE(circle);
      const Vector3 error = circle->x - Vector3{0.1e-3, -0.2e-3, 30e-3};
      nees += error.dot(circle->covariance.inverse() * error) / kTrials;
    }
    EXPECT_GT(nees, 2.5) << tops;  // 3 is right
    EXPECT_LT(nees, 3.6) << tops;
  }
}

TEST(RimCircle, LeavesOutWhatIsNoCircle) {
  std::vector<Edge> edges = outline(144, 0.0, 0.0);
  for (std::size_t k = 20; k < 40; ++k) edges[k].range += 1e-3;
  const auto circle = fit_circle(edges, 30e-3, kDirections, kErrors);
  ASSERT_TRUE(circle);
  EXPECT_LT((circle->x.head<2>() - Vector2{0.1e-3, -0.2e-3}).norm(), 1e-6);
  EXPECT_EQ(edges[30].weight, 0.0);
  std::vector<Edge> two(2);
  two[1].n_W = {0.0, 1.0};
  EXPECT_FALSE(fit_circle(two, 30e-3, kDirections, kErrors).has_value());
}

}  // namespace
}  // namespace breakshot::perception
