#include "perception/perceiver.hpp"
#include "tests/perception/synthetic_image.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace breakshot::perception::test {
namespace {

// Two discs of 30 mm around a place, with a gap along a bearing.
SyntheticScene pair(const Vector2& middle, double bearing, double gap, std::uint8_t colour_b = 5) {
  const Vector2 half = (0.030 + gap / 2.0) * Vector2{std::cos(bearing), std::sin(bearing)};
  SyntheticScene scene;
  scene.discs = {{middle - half, 0.030, 0}, {middle + half, 0.030, colour_b}};
  return scene;
}

class RandomPairs {
 public:
  Scene look(double gap, std::uint8_t colour_b = 5) {
    const auto uniform = [&](double low, double high) { return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0); };
    middle = {uniform(-0.25, 0.25), uniform(-0.22, 0.22)};
    bearing = uniform(0.0, M_PI);
    const auto frames = render(pair(middle, bearing, gap, colour_b), camera_, ++seq_);
    return perceiver_.process(frames.color, &frames.depth);
  }
  Vector2 middle{0.0, 0.0};
  double bearing = 0.0;

 private:
  std::mt19937 random_{5};
  CameraModel camera_ = test_camera();
  Perceiver perceiver_{test_settings(), camera_};
  std::uint64_t seq_ = 0;
};

TEST(PaperContours, FindTouchingPairsAndPushThemAlongTheirCommonTangent) {
  RandomPairs pairs;
  for (int i = 0; i < 12; ++i) {
    const Scene scene = pairs.look(0.0, i % 5 == 0 ? 0 : 5);
    ASSERT_EQ(scene.discs.size(), 2U) << i;
    ASSERT_EQ(scene.contacts.size(), 1U) << i;
    const SceneContact& contact = scene.contacts[0];
    EXPECT_LT(contact.a, contact.b);
    EXPECT_NEAR(contact.gap, 0.0, 0.15e-3);
    EXPECT_GT(contact.p_touch, 0.9);
    const Vector2 tangent{-std::sin(pairs.bearing), std::cos(pairs.bearing)};
    EXPECT_NEAR(contact.push_direction_W.norm(), 1.0, 1e-9);
    EXPECT_GT(std::abs(contact.push_direction_W.dot(tangent)), std::cos(5.0 * M_PI / 180.0));

    // From the end nearer to the arm, over the point of contact, to the other end.
    const Vector2 end = contact.push_start_W + contact.contour_length * contact.push_direction_W;
    const Vector2 p_WB{-0.5, 0.0};
    EXPECT_LE((contact.push_start_W - p_WB).norm(), (end - p_WB).norm());
    EXPECT_LT(((contact.push_start_W + end) / 2.0 - pairs.middle).norm(), 2e-3);
    EXPECT_GT(contact.contour_length, 0.010);
    EXPECT_LT(contact.contour_length, 0.035);
  }
}

TEST(PaperContours, FindNoContactAcrossAGapOfFiveMillimetres) {
  RandomPairs pairs;
  for (int i = 0; i < 12; ++i) {
    const Scene scene = pairs.look(0.005 + 0.001 * i);
    ASSERT_EQ(scene.discs.size(), 2U) << i;
    EXPECT_TRUE(scene.contacts.empty()) << i << " gap " << scene.contacts[0].gap;
  }
}

// The contour method calls a gap of a millimetre a contact; the fitted circles say what it is.
TEST(PaperContours, ComeWithAGapThatTellsWhetherTheyTouch) {
  RandomPairs pairs;
  for (int i = 0; i < 12; ++i) {
    const double gap = 0.001;
    const Scene scene = pairs.look(gap);
    ASSERT_EQ(scene.contacts.size(), 1U) << i;
    EXPECT_NEAR(scene.contacts[0].gap, gap, 0.15e-3);
    EXPECT_LT(scene.contacts[0].p_touch, 0.1);
  }
}

TEST(PaperContours, FindEveryContactOfARack) {
  const CameraModel camera = test_camera();
  Perceiver perceiver{test_settings(), camera};
  SyntheticScene truth;
  const double step = 0.060;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k <= row; ++k) {
      truth.discs.push_back(
          {{0.05 + step * std::sqrt(0.75) * row, step * (k - row / 2.0)}, 0.030, static_cast<std::uint8_t>(truth.discs.size())});
    }
  }
  const auto frames = render(truth, camera, 1);
  const Scene scene = perceiver.process(frames.color, &frames.depth);
  ASSERT_EQ(scene.discs.size(), 6U);
  EXPECT_EQ(scene.contacts.size(), 9U);
  for (const auto& contact : scene.contacts) EXPECT_NEAR(contact.gap, 0.0, 0.2e-3);
}

}  // namespace
}  // namespace breakshot::perception::test
