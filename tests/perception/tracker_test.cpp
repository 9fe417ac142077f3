#include "perception/tracker.hpp"

#include "perception/perceiver.hpp"
#include "tests/perception/synthetic_image.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

namespace breakshot::perception::test {
namespace {

constexpr double kPeriod = 1.0 / 30.0;

Scene scene_at(double seconds, const std::vector<std::pair<Vector2, int>>& discs) {
  Scene scene;
  scene.exposed = time_from_ns(0) + from_seconds(seconds);
  for (const auto& [p, colour] : discs) {
    SceneDisc disc;
    disc.p_WD = p;
    disc.colour = static_cast<std::uint8_t>(colour);
    scene.discs.push_back(disc);
  }
  return scene;
}

class TrackerTest : public ::testing::Test {
 protected:
  Scene update(double seconds, const std::vector<std::pair<Vector2, int>>& discs) {
    Scene scene = scene_at(seconds, discs);
    tracker.update(scene);
    return scene;
  }
  PerceptionSettings settings;
  Tracker tracker{settings};
};

TEST_F(TrackerTest, CallsNothingAtRestInTheFirstFrame) {
  EXPECT_EQ(update(0.0, {{{0, 0}, 0}}).max_speed, std::numeric_limits<double>::infinity());
  EXPECT_EQ(update(kPeriod, {{{0, 0}, 0}}).max_speed, 0.0);
}

TEST_F(TrackerTest, MeasuresVelocityAndKeepsIdentitiesOfOneColourInACrowd) {
  // Three discs of one colour that move past each other at 1 m/s.
  std::map<int, std::uint32_t> ids;
  for (int frame = 0; frame < 12; ++frame) {
    const double t = frame * kPeriod;
    const Scene scene = update(t, {{{-0.2 + t, 0.000}, 0}, {{0.2 - t, 0.065}, 0}, {{0.0, -0.1 + 0.2 * t}, 0}});
    for (int i = 0; i < 3; ++i) {
      const auto& disc = scene.discs[static_cast<std::size_t>(i)];
      if (frame == 0) ids[i] = disc.id;
      EXPECT_EQ(disc.id, ids[i]) << "frame " << frame;
    }
    if (frame == 0) continue;
    EXPECT_NEAR(scene.discs[0].v_WD_W.x(), 1.0, 1e-6);
    EXPECT_NEAR(scene.discs[1].v_WD_W.x(), -1.0, 1e-6);
    EXPECT_NEAR(scene.discs[2].v_WD_W.y(), 0.2, 1e-6);
    EXPECT_NEAR(scene.max_speed, 1.0, 1e-6);
  }
}

TEST_F(TrackerTest, SaysWhenADiscComesOrGoesAndNeverInventsOne) {
  const auto first = update(0.0, {{{0, 0}, 0}, {{0.1, 0}, 1}});
  update(kPeriod, {{{0, 0}, 0}, {{0.1, 0}, 1}});
  const auto gone = update(2 * kPeriod, {{{0, 0}, 0}});
  EXPECT_EQ(gone.discs.size(), 1U);
  EXPECT_EQ(gone.max_speed, std::numeric_limits<double>::infinity());
  EXPECT_EQ(update(3 * kPeriod, {{{0, 0}, 0}}).max_speed, 0.0);
  const auto back = update(4 * kPeriod, {{{0, 0}, 0}, {{0.11, 0}, 1}});
  EXPECT_EQ(back.max_speed, std::numeric_limits<double>::infinity());
  EXPECT_EQ(back.discs[1].id, first.discs[1].id);
  EXPECT_EQ(back.discs[1].v_WD_W, Vector2(0.0, 0.0));
}

TEST_F(TrackerTest, GivesANewIdentityToWhatCannotBeTheOldDisc) {
  const auto first = update(0.0, {{{-0.25, 0}, 0}});
  const auto far = update(kPeriod, {{{0.25, 0}, 0}});  // 15 m/s
  EXPECT_NE(far.discs[0].id, first.discs[0].id);
  const auto recoloured = update(2 * kPeriod, {{{0.25, 0}, 3}});
  EXPECT_NE(recoloured.discs[0].id, far.discs[0].id);
}

TEST_F(TrackerTest, StartsVelocitiesAnewAfterAnInterruption) {
  update(0.0, {{{0, 0}, 0}});
  const auto before = update(kPeriod, {{{0, 0}, 0}});
  tracker.interrupt();
  const auto after = update(3 * kPeriod, {{{0.05, 0}, 0}});
  EXPECT_EQ(after.max_speed, std::numeric_limits<double>::infinity());
  EXPECT_EQ(after.discs[0].v_WD_W, Vector2(0.0, 0.0));
  EXPECT_EQ(after.discs[0].id, before.discs[0].id);
}

TEST(Tracking, MeasuresSlidingAndRestingDiscsFromImages) {
  const CameraModel camera = test_camera();
  Perceiver perceiver{test_settings(), camera};
  for (int frame = 1; frame <= 6; ++frame) {
    SyntheticScene truth;
    truth.discs = {
        {{-0.10 + 0.9 * frame * kPeriod, 0.05 - 0.3 * frame * kPeriod}, 0.030, 0}, {{0.1, -0.15}, 0.030, 0}, {{-0.2, 0.2}, 0.030, 5}};
    const auto frames = render(truth, camera, static_cast<std::uint64_t>(frame));
    const Scene scene = perceiver.process(frames.color, &frames.depth);
    ASSERT_EQ(scene.discs.size(), 3U);
    if (frame == 1) continue;
    EXPECT_NEAR(scene.max_speed, std::hypot(0.9, 0.3), 4e-3);
    for (const auto& disc : scene.discs) {
      const bool slides = disc.colour == 0 && disc.p_WD.y() > -0.1;
      EXPECT_NEAR(disc.v_WD_W.x(), slides ? 0.9 : 0.0, 4e-3);
      EXPECT_NEAR(disc.v_WD_W.y(), slides ? -0.3 : 0.0, 4e-3);
    }
  }
}

}  // namespace
}  // namespace breakshot::perception::test
