#include "perception/image_check.hpp"

#include "perception/perceiver.hpp"
#include "tests/perception/synthetic_image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <utility>

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

// As when half of a transfer was lost: the rest of the buffer still holds the frame before.
TEST_F(BadImages, FrozenInPartAreRefused) {
  auto frame = next().color;
  const std::size_t half = frame.rgb.size() / 2;
  std::copy_n(good.color.rgb.begin() + static_cast<std::ptrdiff_t>(half), half, frame.rgb.begin() + static_cast<std::ptrdiff_t>(half));
  expect_refused(frame, SceneQuality::kFrozen, "in 4 of 8 bands of rows, the first from row 360 on");
  EXPECT_EQ(perceiver.process(next().color, nullptr).quality, SceneQuality::kOk);
}

TEST_F(BadImages, OverexposedAreRefusedOnceNothingButWhiteIsLeft) {
  truth.brightness = 3.0;  // the table is white, discs are not
  truth.noise = 0.0;
  const Scene bright = perceiver.process(next().color, nullptr);
  EXPECT_EQ(bright.quality, SceneQuality::kOk) << bright.text;
  EXPECT_EQ(bright.discs.size(), 1U);
  truth.brightness = 100.0;
  expect_refused(next().color, SceneQuality::kBadImage, "nothing but white");
}

TEST_F(BadImages, WithoutTableAreRefused) {
  truth.plates = {{Rect{{-1.0, -1.0}, {1.0, 1.0}}, 0.0, {0.02, 0.30, 0.03}}};  // green all over
  truth.discs.clear();
  expect_refused(next().color, SceneQuality::kBadImage, "found no table");
}

TEST_F(BadImages, WithRedAndBlueExchangedAreRefused) {
  // By the discs: the table is grey either way.
  const auto exchange = [](ColorFrame& frame) {
    for (std::size_t i = 0; i < frame.rgb.size(); i += 3) std::swap(frame.rgb[i], frame.rgb[i + 2]);
  };
  for (std::uint8_t k = 1; k < 6; ++k) truth.discs.push_back({{-0.25 + 0.1 * k, -0.1}, 0.030, k, 0.0});
  auto frame = next().color;
  EXPECT_EQ(perceiver.process(frame, nullptr).discs.size(), 6U);
  frame = next().color;
  exchange(frame);
  expect_refused(frame, SceneQuality::kBadImage, "red and blue look swapped");
}

TEST_F(BadImages, TooOldOrFromTheFutureAreSaidToBe) {
  ColorFrame frame;
  frame.seq = 4;
  frame.exposed = time_from_ns(5'000'000'000);
  const Duration limit = std::chrono::seconds{1};
  EXPECT_EQ(stale(frame, frame.exposed + std::chrono::milliseconds{900}, limit), std::nullopt);
  EXPECT_THAT(stale(frame, frame.exposed + std::chrono::milliseconds{1500}, limit).value(),
              HasSubstr("colour frame 4: found a stamp 1500 ms old; at most 1000 ms is allowed"));
  EXPECT_THAT(stale(frame, frame.exposed - std::chrono::milliseconds{200}, limit).value(), HasSubstr("200 ms in the future"));
  const Scene scene = perceiver.refuse(frame, "found a stamp 1500 ms old");
  EXPECT_EQ(scene.quality, SceneQuality::kBadImage);
  EXPECT_EQ(scene.frame_seq, 4U);
  EXPECT_TRUE(scene.discs.empty());
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
