#include "perception/image_check.hpp"

#include "perception/perceiver.hpp"
#include "tests/perception/synthetic_image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace breakshot::perception::test {
namespace {

using ::testing::HasSubstr;

class BadImages : public ::testing::Test {
 protected:
  void SetUp() override {
    truth.discs = {{{0.1, 0.05}, 0.030, 0}};
    good = render(truth, camera, 1);
    ASSERT_EQ(perceiver.process(good.color, &good.depth).discs.size(), 1U);
  }
  SyntheticFrames next() { return render(truth, camera, ++seq); }
  Scene expect_refused(const ColorFrame& frame, SceneQuality quality, const std::string& words) {
    const Scene scene = perceiver.process(frame, nullptr);
    EXPECT_EQ(scene.quality, quality) << scene.text;
    EXPECT_TRUE(scene.discs.empty());
    EXPECT_EQ(scene.max_speed, std::numeric_limits<double>::infinity());
    EXPECT_EQ(scene.frame_seq, frame.seq);
    EXPECT_LE(scene.text.size(), 255U);
    EXPECT_THAT(scene.text, HasSubstr(words));
    return scene;
  }
  CameraModel camera = test_camera();
  Perceiver perceiver{test_settings(), camera};
  SyntheticScene truth;
  SyntheticFrames good;
  std::uint64_t seq = 1;
};

TEST_F(BadImages, OfTheWrongSizeAreRefused) {
  auto frame = next().color;
  frame.width = 640;
  expect_refused(frame, SceneQuality::kBadImage, "found 640 x 720 px; the calibrated camera has 1280 x 720 px");
  frame = next().color;
  frame.rgb.pop_back();
  expect_refused(frame, SceneQuality::kBadImage, "found 2764799 bytes; RGB of 8 bits at 1280 x 720 px takes 2764800");
  frame = ColorFrame{};
  expect_refused(frame, SceneQuality::kBadImage, "found 0 x 0 px");
}

TEST_F(BadImages, WithAStampThatGoesBackAreRefusedOnce) {
  auto frame = next().color;
  frame.exposed = good.color.exposed - std::chrono::milliseconds{5};
  expect_refused(frame, SceneQuality::kBadImage, "5000000 ns behind");
  frame = next().color;
  frame.exposed = good.color.exposed - std::chrono::milliseconds{4};  // a camera that was started anew counts on from there
  EXPECT_EQ(perceiver.process(frame, nullptr).quality, SceneQuality::kOk);
}

TEST_F(BadImages, FrozenUnderNewStampsAreRefusedUntilThePictureMoves) {
  auto frame = good.color;
  for (int i = 1; i <= 3; ++i) {
    frame.exposed += std::chrono::milliseconds{33};
    ++frame.seq;
    expect_refused(frame, SceneQuality::kFrozen, "content of the frame before it");
  }
  auto live = next();
  live.color.exposed = frame.exposed + std::chrono::milliseconds{33};
  live.color.seq = live.depth.seq = frame.seq + 1;
  EXPECT_EQ(perceiver.process(live.color, &live.depth).discs.size(), 1U);
}

TEST_F(BadImages, WithoutLightAreRefused) {
  truth.brightness = 0.002;
  expect_refused(next().color, SceneQuality::kDark, "brightest percent");
  truth.brightness = 1.0;
  EXPECT_EQ(perceiver.process(next().color, nullptr).quality, SceneQuality::kOk);
}

TEST_F(BadImages, WithoutColourAreRefused) {
  auto frame = next().color;
  for (std::size_t i = 0; i < frame.rgb.size(); i += 3) frame.rgb[i + 1] = frame.rgb[i + 2] = frame.rgb[i];
  expect_refused(frame, SceneQuality::kBadImage, "found no colour: red, green and blue are equal everywhere");
}

TEST_F(BadImages, DepthThatDoesNotFitIsIgnoredAndSaidSo) {
  auto frames = next();
  frames.depth.seq = 77;
  Scene scene = perceiver.process(frames.color, &frames.depth);
  EXPECT_EQ(scene.discs.size(), 1U);
  EXPECT_THAT(scene.text, HasSubstr("went on without depth"));
  frames = next();
  frames.depth.depth.resize(10);
  scene = perceiver.process(frames.color, &frames.depth);
  EXPECT_EQ(scene.discs.size(), 1U);
  EXPECT_THAT(scene.text, HasSubstr("found 10 values"));
}

}  // namespace
}  // namespace breakshot::perception::test
