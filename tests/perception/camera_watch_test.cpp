// The watch over the camera's place, on the pictures of the cell's own camera with the cell's own markers.

#include "perception/camera_watch.hpp"

#include "common/config/camera_file.hpp"
#include "common/random.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/kinematics/inverse_kinematics.hpp"
#include "perception/perceiver.hpp"
#include "perception/perception_config.hpp"
#include "sim_bridge/sim_bridge_config.hpp"
#include "tests/support/render_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

namespace breakshot::perception {
namespace {

using ::testing::HasSubstr;
using Verdict = CameraCheck::Verdict;

constexpr double kDegree = std::numbers::pi / 180.0;

class CameraWatchTest : public ::testing::Test {
 protected:
  // A camera that truly stands so; it takes 0.3 s to make.
  std::unique_ptr<support::SceneRenderer> camera_at(const Vector3& by_W = Vector3::Zero(), const Vector3& turn_C = Vector3::Zero()) const {
    sim_bridge::CameraSettings moved = sim;
    moved.move = {by_W, turn_C};
    return std::make_unique<support::SceneRenderer>(moved, model, arm, cell.arm.X_WB);
  }
  std::vector<Pose> links(const JointVector& q) const {
    std::vector<Pose> X_WL(arm.links.size());
    (void)kinematics.links_in_world(q, X_WL);
    return X_WL;
  }
  support::RenderedScene take(support::SceneRenderer& renderer, std::span<const Pose> X_WL) {
    ++frame;
    auto picture = renderer.take(support::rack_of_six({-0.05, 0.0}), frame, X_WL);
    picture.color.seq = picture.depth.seq = frame;
    picture.color.exposed = picture.depth.exposed = time_from_ns(static_cast<std::int64_t>(frame) * 33'333'333);
    return picture;
  }
  static cv::Mat3b rgb_of(support::RenderedScene& picture) {
    return {picture.color.height, picture.color.width, reinterpret_cast<cv::Vec3b*>(picture.color.rgb.data())};
  }
  CameraCheck look(support::SceneRenderer& renderer) {
    auto picture = take(renderer, parked);
    return watch.look(rgb_of(picture));
  }

  ConfigDocument document = load_cell_document(BREAKSHOT_SOURCE_DIR "/config/cell.yaml");
  CellConfig cell = load_cell_config(document);
  PerceptionSettings settings = load_perception_config(document, cell).settings;
  sim_bridge::CameraSettings sim = sim_bridge::load_sim_bridge_config(document, cell).camera;
  CameraModel model = load_camera(cell.camera_file);
  ArmDescription arm = load_cell_arm(cell);
  kinematics::ArmKinematics kinematics{arm, cell.arm.X_WB};
  std::vector<Pose> parked = links(cell.arm.park);
  ArmMask mask{model, arm, cell.arm.X_WB, settings.arm_margin};
  CameraWatch watch{model, settings.watch, mask};
  std::uint64_t frame = 0;
};

// Every frame is looked at, twice as often as it would be, and none of them comes near an alarm.
TEST_F(CameraWatchTest, AThousandNoisyFramesRingNothing) {
  const auto camera = camera_at();
  mask.place(parked);
  double worst = 0.0, sum = 0.0, cpu = 0.0;
  int all_seen = 0;
  constexpr int kFrames = 1000;
  for (int i = 0; i < kFrames; ++i) {
    auto picture = take(*camera, parked);
    const std::clock_t begin = std::clock();
    const CameraCheck check = watch.look(rgb_of(picture));
    cpu += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    ASSERT_EQ(check.verdict, Verdict::kInPlace) << i;
    worst = std::max(worst, check.shift);
    sum += check.shift;
    all_seen += check.seen == 4 ? 1 : 0;
  }
  std::printf("  %d frames: shift %.3f mm on average, %.3f mm at most; all four markers seen in %d; %.2f ms of CPU a look\n", kFrames,
              1e3 * sum / kFrames, 1e3 * worst, all_seen, 1e3 * cpu / kFrames);
  EXPECT_LT(worst, 0.5 * settings.watch.max_shift);
  EXPECT_EQ(all_seen, kFrames);
}

TEST_F(CameraWatchTest, AMillimetreOrATenthOfADegreeIsSeen) {
  struct Move {
    Vector3 by_W, turn_C;
  };
  mask.place(parked);
  for (const int axis : {0, 1, 2}) {
    for (const double sign : {-1.0, 1.0}) {
      for (const Move& move :
           {Move{sign * 1e-3 * Vector3::Unit(axis), Vector3::Zero()}, Move{Vector3::Zero(), sign * 0.1 * kDegree * Vector3::Unit(axis)}}) {
        const auto camera = camera_at(move.by_W, move.turn_C);
        const CameraCheck check = look(*camera);
        EXPECT_EQ(check.verdict, Verdict::kMoved) << move.by_W.transpose() << " " << move.turn_C.transpose();
        EXPECT_EQ(check.seen, 4);
        // A tilt and a step aside look much alike: what they do to the table tells more than how much of each it is.
        EXPECT_NEAR(check.moved, move.by_W.norm(), 0.5e-3);
        EXPECT_NEAR(check.turned, move.turn_C.norm(), 0.03 * kDegree);
        std::printf("  %s%c by %s: shift %.2f mm, moved %.2f mm, turned %.3f deg\n", sign < 0 ? "-" : "+", "xyz"[axis],
                    move.by_W.isZero() ? "0.1 deg" : "1 mm", 1e3 * check.shift, 1e3 * check.moved, check.turned / kDegree);
      }
    }
  }
}

// Wherever the arm is, with its shadow on the markers, what it leaves of them rings nothing.
TEST_F(CameraWatchTest, TheArmRingsNothing) {
  const auto camera = camera_at();
  SplitMix64 random{4};
  int looks = 0, nothing = 0;
  double worst = 0.0;
  while (looks < 100) {
    Pose X_WT{Pose::Identity()};
    X_WT.translation() << random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3), random.uniform(0.03, 0.15);
    X_WT.linear() = (Eigen::AngleAxisd{random.uniform(-3.0, 3.0), Vector3::UnitZ()} * Eigen::AngleAxisd{std::numbers::pi, Vector3::UnitX()})
                        .toRotationMatrix();
    const auto solutions = kinematics::InverseKinematics{kinematics}.solve(X_WT, cell.arm.park);
    if (solutions.empty()) continue;
    ++looks;
    const auto X_WL = links(*solutions.begin());
    mask.place(X_WL);
    auto picture = take(*camera, X_WL);
    const CameraCheck check = watch.look(rgb_of(picture));
    nothing += check.verdict == Verdict::kNothing ? 1 : 0;
    EXPECT_TRUE(check.verdict == Verdict::kNothing || check.verdict == Verdict::kInPlace)
        << looks << ": " << 1e3 * check.shift << " mm, " << check.seen;
    EXPECT_EQ(check.seen, check.expected);
    worst = std::max(worst, check.shift);
  }
  std::printf("  %d places of the arm: shift %.3f mm at most; in %d no verdict\n", looks, 1e3 * worst, nothing);
  EXPECT_LT(nothing, 20);
}

TEST_F(CameraWatchTest, LightFromAThirdToTwiceChangesNothing) {
  const auto camera = camera_at();
  mask.place(parked);
  for (const double brightness : {0.3, 2.0}) {
    sim_bridge::Exposure exposure;
    exposure.brightness = brightness;
    camera->set_exposure(exposure);
    const CameraCheck check = look(*camera);
    EXPECT_EQ(check.verdict, Verdict::kInPlace) << brightness;
    EXPECT_EQ(check.seen, 4) << brightness;
    EXPECT_LT(check.shift, 0.25e-3) << brightness;
  }
}

TEST_F(CameraWatchTest, TheSecondFrameInARowRingsAndSilences) {
  const auto straight = camera_at(), aside = camera_at({2e-3, 0.0, 0.0});
  settings.watch.period = Duration::zero();
  Perceiver eyes{settings, model, arm, cell.arm.X_WB};
  const auto see = [&](support::SceneRenderer& renderer) {
    const auto picture = take(renderer, parked);
    return eyes.process(picture.color, &picture.depth, parked);
  };
  EXPECT_EQ(see(*straight).quality, SceneQuality::kOk);
  EXPECT_EQ(see(*aside).quality, SceneQuality::kOk);
  const Scene alarm = see(*aside);
  EXPECT_EQ(alarm.quality, SceneQuality::kMisplaced);
  EXPECT_TRUE(alarm.discs.empty());
  EXPECT_THAT(alarm.text, HasSubstr("the table seems shifted by up to 2.0"));
  EXPECT_THAT(alarm.text, HasSubstr("4 of 4 markers seen"));
  EXPECT_LE(alarm.text.size(), 255U);
  EXPECT_EQ(see(*straight).quality, SceneQuality::kMisplaced);
  EXPECT_EQ(see(*aside).quality, SceneQuality::kMisplaced);
  EXPECT_EQ(see(*straight).quality, SceneQuality::kMisplaced);
  const Scene back = see(*straight);
  EXPECT_EQ(back.quality, SceneQuality::kOk);
  EXPECT_EQ(back.discs.size(), 6U);
}

TEST_F(CameraWatchTest, LooksOnceAPeriodAndAgainToBeSure) {
  const auto straight = camera_at(), aside = camera_at({2e-3, 0.0, 0.0});
  mask.place(parked);
  const auto rings = [&](support::SceneRenderer& renderer) {
    auto picture = take(renderer, parked);
    return watch.on_frame(rgb_of(picture), picture.color.exposed, false).has_value();
  };
  EXPECT_FALSE(rings(*straight));
  int frames = 1;
  while (!rings(*aside)) ++frames;
  EXPECT_EQ(frames, 17) << "fifteen frames last 5 ns less than half a second; and one more to be sure";
}

// The planner decides on the second scene at rest (cell.yaml: planner.task.settled_scenes). A knock looks as if all discs moved, and what comes to rest is
// looked at at once: there is no second one.
TEST_F(CameraWatchTest, NobodyDecidesOnWhatAKnockedCameraSees) {
  const auto straight = camera_at(), aside = camera_at({1e-3, 0.0, 0.0});
  Perceiver eyes{settings, model, arm, cell.arm.X_WB};
  for (const int before : {3, 7, 12}) {
    for (int i = 0; i < before + 20; ++i) {
      const auto picture = take(*straight, parked);
      (void)eyes.process(picture.color, &picture.depth, parked);
    }
    int at_rest = 0;
    for (int i = 0; i < 20; ++i) {
      const auto picture = take(*aside, parked);
      const Scene scene = eyes.process(picture.color, &picture.depth, parked);
      at_rest += scene.quality == SceneQuality::kOk && scene.max_speed < 0.02 ? 1 : 0;
    }
    EXPECT_LE(at_rest, 1) << before;
  }
}

TEST_F(CameraWatchTest, ACameraThatIsFarOffIsFoundAllOverTheImage) {
  const auto camera = camera_at({0.02, 0.0, 0.0}, {0.0, 0.0, 6.0 * kDegree});
  Perceiver eyes{settings, model, arm, cell.arm.X_WB};
  Scene scene;
  for (int i = 0; i < 60 && scene.quality == SceneQuality::kOk; ++i) {
    auto picture = take(*camera, parked);
    scene = eyes.process(picture.color, &picture.depth, parked);
  }
  EXPECT_EQ(scene.quality, SceneQuality::kMisplaced);
  EXPECT_THAT(scene.text, HasSubstr("and 6.0"));
}

TEST_F(CameraWatchTest, MarkersThatNobodySeesAreSaid) {
  sim.table.markers.clear();
  const auto camera = camera_at();
  Perceiver eyes{settings, model, arm, cell.arm.X_WB};
  int frames = 0;
  Scene scene;
  for (; frames < 100 && scene.quality == SceneQuality::kOk; ++frames) {
    const auto picture = take(*camera, parked);
    scene = eyes.process(picture.color, &picture.depth, parked);
  }
  EXPECT_EQ(scene.quality, SceneQuality::kMisplaced);
  EXPECT_THAT(scene.text, HasSubstr("none of the 4 markers on the table is seen"));
  EXPECT_GT(frames, 30) << "one look without a marker proves little";
}

TEST_F(CameraWatchTest, WithoutMarkersNothingIsWatched) {
  sim.table.markers.clear();
  settings.watch.markers.at.clear();
  const auto camera = camera_at({0.01, 0.0, 0.0});
  Perceiver eyes{settings, model, arm, cell.arm.X_WB};
  for (int i = 0; i < 70; ++i) {
    const auto picture = take(*camera, parked);
    EXPECT_EQ(eyes.process(picture.color, &picture.depth, parked).quality, SceneQuality::kOk);
  }
}

}  // namespace
}  // namespace breakshot::perception
