#include "perception/perceiver.hpp"
#include "tests/perception/synthetic_image.hpp"

#include <gtest/gtest.h>

#include <string>

namespace breakshot::perception::test {
namespace {

using Kind = ForeignObject::Kind;
const Eigen::Vector3d kSkin{0.45, 0.22, 0.15};  // linear: a hue between two discs' colours, hardly saturated
const Eigen::Vector3d kGrey{0.20, 0.20, 0.19};  // the table's own

class Foreign : public ::testing::Test {
 protected:
  Scene look(bool with_depth) {
    const auto frames = render(truth, camera, ++seq);
    return perceiver.process(frames.color, with_depth ? &frames.depth : nullptr);
  }
  void SetUp() override { truth.discs = {{{0.12, 0.10}, 0.030, 0}, {{-0.15, -0.10}, 0.025, 5}, {{-0.15, 0.12}, 0.040, 3}}; }

  CameraModel camera = test_camera();
  Perceiver perceiver{test_settings(), camera};
  SyntheticScene truth;
  std::uint64_t seq = 0;
};

TEST_F(Foreign, NothingIsReportedOfDiscsAlone) {
  for (std::uint32_t i = 0; i < 6; ++i) {
    truth.discs = touching_discs(40 + i, 12, Rect{{-0.28, -0.25}, {0.28, 0.25}}, 0.016, 0.035, i % 2 == 0 ? 1 : 8);
    for (const bool depth : {false, true}) {
      const Scene scene = look(depth);
      EXPECT_EQ(scene.discs.size(), truth.discs.size());
      EXPECT_TRUE(scene.foreign.empty()) << describe(scene.foreign.front());
    }
  }
}

TEST_F(Foreign, AToolOfTheTablesColourIsSeenByItsHeight) {
  truth.plates = {{Rect{{-0.02, -0.15}, {0.0, 0.05}}, 0.015, kGrey}};
  EXPECT_TRUE(look(false).foreign.empty());  // by colour it is the table
  const Scene scene = look(true);
  EXPECT_EQ(scene.discs.size(), 3U);
  ASSERT_EQ(scene.foreign.size(), 1U);
  EXPECT_EQ(scene.foreign[0].kind, Kind::kHeight);
  EXPECT_LT((scene.foreign[0].p_W - Vector2{-0.01, -0.05}).norm(), 0.015);
  EXPECT_NEAR(scene.foreign[0].height, 0.015, 0.005);
  EXPECT_NEAR(scene.foreign[0].extent, 0.10, 0.025);
}

TEST_F(Foreign, AHandOverTheDiscsIsNoDisc) {
  // A palm with four fingers; it covers the first disc.
  truth.plates = {{Rect{{0.05, 0.05}, {0.30, 0.14}}, 0.05, kSkin}};
  for (int finger = 0; finger < 4; ++finger) {
    truth.plates.push_back({Rect{{-0.02, 0.052 + 0.023 * finger}, {0.05, 0.068 + 0.023 * finger}}, 0.05, kSkin});
  }
  const Scene scene = look(true);
  EXPECT_EQ(scene.discs.size(), 2U);
  ASSERT_FALSE(scene.foreign.empty());
  EXPECT_EQ(scene.foreign[0].kind, Kind::kHeight);
  EXPECT_NEAR(scene.foreign[0].height, 0.05, 0.006);
  EXPECT_FALSE(describe(scene.foreign[0]).empty());
}

TEST_F(Foreign, PaintThatIsNoDiscIsSeenByColourAlone) {
  for (const Rect& area : {Rect{{-0.02, -0.04}, {0.04, 0.02}}, Rect{{-0.1, -0.24}, {0.1, -0.21}}}) {
    truth.plates = {{area, 0.001, {0.45, 0.02, 0.02}}};  // red, as one of the discs
    const Scene scene = look(false);
    EXPECT_EQ(scene.discs.size(), 3U);
    ASSERT_EQ(scene.foreign.size(), 1U);
    EXPECT_EQ(scene.foreign[0].kind, Kind::kPaint);
    EXPECT_LT((scene.foreign[0].p_W - 0.5 * (area.min + area.max)).norm(), 0.01);
  }
}

TEST_F(Foreign, PaintAgainstADiscOfItsColourIsToldFromIt) {
  truth.plates = {{Rect{{0.145, 0.08}, {0.20, 0.12}}, 0.001, {0.45, 0.02, 0.02}}};
  const Scene scene = look(false);
  EXPECT_EQ(scene.discs.size(), 3U);
  ASSERT_EQ(scene.foreign.size(), 1U);
  EXPECT_EQ(scene.foreign[0].kind, Kind::kPaint);
}

TEST_F(Foreign, ADiscOffTheTableIsSeenByItsHeight) {
  truth.discs[1].lift = 0.012;
  const Scene scene = look(true);
  ASSERT_EQ(scene.foreign.size(), 1U);
  EXPECT_EQ(scene.foreign[0].kind, Kind::kOffTable);
  EXPECT_NEAR(scene.foreign[0].height, 0.032, 0.004);
  EXPECT_LT((scene.foreign[0].p_W - truth.discs[1].p_WD).norm(), 0.006);
}

TEST_F(Foreign, ADiscOnAnotherIsSeenWithAndWithoutDepth) {
  // On top of the third one, shifted; of another colour, smaller.
  truth.discs.push_back({{-0.135, 0.125}, 0.025, 6, 0.020});
  const Scene scene = look(true);
  ASSERT_FALSE(scene.foreign.empty());
  EXPECT_EQ(scene.foreign[0].kind, Kind::kOffTable);
  EXPECT_FALSE(look(false).foreign.empty());
}

// A whole depth image that is off by more than a disc's height, as real ones are, changes nothing.
TEST_F(Foreign, HeightsAreCountedFromTheTableThatDepthShows) {
  auto frames = render(truth, camera, ++seq);
  for (auto& range : frames.depth.depth) range = static_cast<std::uint16_t>(range - 250);
  EXPECT_TRUE(perceiver.process(frames.color, &frames.depth).foreign.empty());
}

// No joint states: the arm is what stands up and hangs together with its base. What stands by itself does not belong there.
TEST_F(Foreign, WithoutJointStatesTheArmIsTakenForItselfAndAToolIsNot) {
  ArmDescription arm;
  arm.links.emplace_back();
  Perceiver eyes{test_settings(), camera, arm};
  const SyntheticPlate base{Rect{{-0.60, -0.06}, {-0.40, 0.06}}, 0.10, kGrey};
  const SyntheticPlate forearm{Rect{{-0.42, -0.04}, {-0.12, 0.04}}, 0.15, kGrey};
  truth.plates = {forearm, base};
  const auto look_for = [&](bool with_depth) {
    const auto frames = render(truth, camera, ++seq);
    return eyes.process(frames.color, with_depth ? &frames.depth : nullptr).foreign;
  };
  EXPECT_TRUE(look_for(true).empty());
  truth.plates.push_back({Rect{{0.00, -0.15}, {0.04, -0.05}}, 0.05, kGrey});
  const auto found = look_for(true);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, Kind::kHeight);
  EXPECT_LT((found[0].p_W - Vector2{0.02, -0.10}).norm(), 0.02);
  EXPECT_TRUE(look_for(false).empty());  // without depth either nobody can tell
  truth.plates = {{Rect{{0.00, -0.15}, {0.04, -0.05}}, 0.05, kGrey}};
  EXPECT_TRUE(look_for(true).empty());  // nor where the base does not show
}

}  // namespace
}  // namespace breakshot::perception::test
