#include "perception/annotate.hpp"

#include "perception/perceiver.hpp"
#include "tests/perception/synthetic_image.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace breakshot::perception::test {
namespace {

class Annotating : public ::testing::Test {
 protected:
  Annotating() {
    SyntheticScene truth;
    truth.discs = {{{0.10, 0.03}, 0.030, 0}, {{0.10, -0.03}, 0.030, 5}, {{-0.1, 0.1}, 0.030, 3}};
    frames = render(truth, camera, 1);
    scene = Perceiver{test_settings(), camera}.process(frames.color, &frames.depth);
    annotation.workspace = {{-0.3, -0.3}, {0.3, 0.3}};
  }
  // Pixels that differ from the image, in a square around a place of W.
  int changed(const ColorFrame& drawn, const Vector2& p_W, int half_side) const {
    const auto at = camera.project({p_W.x(), p_W.y(), 0.02});
    int count = 0;
    for (int y = static_cast<int>(at->y()) - half_side; y <= static_cast<int>(at->y()) + half_side; ++y) {
      for (int x = static_cast<int>(at->x()) - half_side; x <= static_cast<int>(at->x()) + half_side; ++x) {
        const auto i = 3 * (static_cast<std::size_t>(y) * 1280 + static_cast<std::size_t>(x));
        count += std::equal(drawn.rgb.begin() + static_cast<std::ptrdiff_t>(i), drawn.rgb.begin() + static_cast<std::ptrdiff_t>(i) + 3,
                            frames.color.rgb.begin() + static_cast<std::ptrdiff_t>(i))
                     ? 0
                     : 1;
      }
    }
    return count;
  }
  CameraModel camera = test_camera();
  SyntheticFrames frames;
  Scene scene;
  Annotation annotation;
};

TEST_F(Annotating, DrawsWhereThingsAreAndNowhereElse) {
  const ColorFrame plain = annotate(frames.color, scene, camera, annotation);
  EXPECT_EQ(plain.rgb.size(), frames.color.rgb.size());
  EXPECT_GT(changed(plain, {-0.1, 0.1}, 8), 50);  // a disc's id
  EXPECT_GT(changed(plain, {0.1, 0.0}, 6), 20);   // a contact
  EXPECT_EQ(changed(plain, {0.0, -0.2}, 20), 0);  // bare table

  annotation.stroke = StrokeRequest{.id = 1, .kind = StrokeKind::kPush, .p_WS = {-0.05, -0.2}, .direction_W = {1.0, 0.0}, .length = 0.1};
  annotation.predicted_p_WD = {{0.1, 0.2}, {0.1, -0.03}, {-0.1, 0.1}};
  const ColorFrame with_stroke = annotate(frames.color, scene, camera, annotation);
  EXPECT_GT(changed(with_stroke, {0.0, -0.2}, 20), 50);
  EXPECT_GT(changed(with_stroke, {0.13, 0.2}, 8), 5);
}

TEST_F(Annotating, CopesWithAnythingInAScene) {
  scene.discs.push_back(SceneDisc{.id = 99, .p_WD = {40.0, -70.0}, .radius = 3.0});
  annotation.stroke = StrokeRequest{.kind = StrokeKind::kHit, .p_WS = {0.6, 0.4}, .direction_W = {0.0, 1.0}, .speed = 0.8, .run_in = 1.0};
  annotation.predicted_p_WD = {{9.0, 9.0}};
  annotation.headline = std::string(300, 'x');
  annotation.detail = "predicted gap 17.1 mm";
  EXPECT_NO_THROW(annotate(frames.color, scene, camera, annotation));
}

TEST_F(Annotating, RefusesAnImageOfAnotherSize) {
  frames.color.width = 640;
  EXPECT_THROW(annotate(frames.color, scene, camera, annotation), std::invalid_argument);
}

}  // namespace
}  // namespace breakshot::perception::test
