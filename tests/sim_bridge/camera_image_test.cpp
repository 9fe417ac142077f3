#include "sim_bridge/camera/headless_context.hpp"
#include "tests/sim_bridge/camera_picture.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <numeric>
#include <thread>

namespace breakshot::sim_bridge {
namespace {

using support::disc_at;
using support::rack_of_six;
using support::RenderedScene;
using support::SceneRenderer;

/// An arm of one link: a level grey bar of 0.2 m x 0.1 m x 0.02 m around the link's origin.
ArmDescription bar_arm() {
  Shape bar;
  bar.size = {0.2, 0.1, 0.02};
  ArmDescription arm;
  arm.joints.resize(1);
  arm.links.resize(1);
  arm.links[0].visuals = {bar};
  return arm;
}

Pose at(double x, double y, double z) { return Pose{Eigen::Translation3d{x, y, z}}; }

bool same(const RenderedScene& a, const RenderedScene& b) { return a.color.rgb == b.color.rgb && a.depth.depth == b.depth.depth; }

double mean_of(const ColorFrame& frame) {
  return std::accumulate(frame.rgb.begin(), frame.rgb.end(), 0.0) / static_cast<double>(frame.rgb.size());
}

TEST(CameraImage, TheSameSnapshotAndFrameGiveTheSameBytesWhateverCameBefore) {
  SceneRenderer a, b;
  const auto rack = rack_of_six({0.0, 0.0});
  const auto lone = disc_at(-0.2, 0.2, 2);
  b.take(rack, 1);
  b.take({&lone, 1}, 2);
  b.take({}, 3);
  const auto first = a.take(rack, 10), again = b.take(rack, 10);
  EXPECT_TRUE(same(first, again));
  EXPECT_FALSE(same(first, b.take(rack, 11)));
}

TEST(CameraImage, RendersOnWhateverThreadCallsIt) {
  SceneRenderer renderer;
  const auto rack = rack_of_six({0.1, 0.0});
  const auto here = renderer.take(rack, 1);
  RenderedScene there;
  std::thread{[&] { there = renderer.take(rack, 1); }}.join();
  EXPECT_TRUE(same(here, there));
}

TEST(CameraImage, AContextServesOneThreadAtATime) {
  const HeadlessContext context;
  const HeadlessContext::Current current{context};
  bool refused = false;
  std::thread{[&] {
    try {
      const HeadlessContext::Current second{context};
    } catch (const CameraError&) {
      refused = true;
    }
  }}.join();
  EXPECT_TRUE(refused);
}

TEST(CameraImage, ADiscHasATopAndADarkerSide) {
  SceneRenderer renderer{plain_settings()};
  const auto disc = disc_at(0.25, 0.0, 0);
  const auto scene = renderer.take({&disc, 1});
  const auto top = colour_at(scene.color, *scene.camera.project({0.25, 0.0, 0.02}));
  const auto side = colour_at(scene.color, *scene.camera.project({0.22, 0.0, 0.010}));
  const auto table = colour_at(scene.color, *scene.camera.project({0.21, 0.0, 0.0}));
  EXPECT_GT(top[0], 2 * top[1]);
  EXPECT_GT(side[0], 2 * side[1]);
  EXPECT_LT(side[0], top[0] - 20);
  EXPECT_LT(std::abs(table[0] - table[1]), 15);
}

TEST(CameraImage, DiscsDarkenTheTableBesideThemTowardsTheShadow) {
  CameraSettings settings = plain_settings();
  settings.light.shadows = true;
  settings.light.lamps[0].towards_W = {0.5, 0.0, 1.0};
  SceneRenderer renderer{settings};
  const auto disc = disc_at(0.0, 0.0, 2);
  const auto scene = renderer.take({&disc, 1}), bare = renderer.take({});
  const auto darkening = [&](double x) {
    const Vector2 pixel = *scene.camera.project({x, 0.0, 0.0});
    return colour_at(bare.color, pixel)[1] - colour_at(scene.color, pixel)[1];
  };
  EXPECT_GT(darkening(-0.034), 30);  // 20 mm high, light at slope 1/2: the shadow reaches 10 mm from the foot
  EXPECT_GT(darkening(0.034), 3);    // towards the light only some sky is missing
  EXPECT_GT(darkening(-0.034), darkening(0.034) + 20);
  EXPECT_EQ(darkening(-0.08), 0);
  EXPECT_EQ(darkening(0.08), 0);
}

TEST(CameraImage, AGapBetweenDiscsShowsTheTable) {
  SceneRenderer renderer{plain_settings()};
  const std::vector<DiscState> discs{disc_at(-0.033, 0.0, 0), disc_at(0.033, 0.0, 0)};
  const auto scene = renderer.take(discs);
  const auto between = colour_at(scene.color, *scene.camera.project({0.0, 0.0, 0.0}));
  EXPECT_LT(std::abs(between[0] - between[1]), 15);
}

TEST(CameraImage, TheArmHidesDiscsAndLeavesNothingBehindWhenItGoes) {
  SceneRenderer renderer{CameraSettings{}, support::cell_camera(), bar_arm()};
  const auto rack = rack_of_six({0.0, 0.0});
  const Pose away = at(0.0, 5.0, 0.1);
  const auto before = renderer.take(rack, 1, {&away, 1});

  const Pose over = at(0.02, 0.0, 0.2);
  const auto hidden = renderer.take(rack, 1, {&over, 1});
  const Vector2 on_the_bar = *hidden.camera.project({0.02, 0.0, 0.21});
  const auto colour = colour_at(hidden.color, on_the_bar);
  EXPECT_LT(*std::max_element(colour.begin(), colour.end()) - *std::min_element(colour.begin(), colour.end()), 15);
  EXPECT_NEAR(depth_at(hidden.depth, on_the_bar), 5900, 60);

  EXPECT_TRUE(same(before, renderer.take(rack, 1, {&away, 1})));
}

TEST(CameraImage, TheArmShadesTableAndDiscs) {
  CameraSettings settings = plain_settings();
  settings.light.shadows = true;
  settings.light.lamps[0].towards_W = {1.0, 0.0, 1.0};
  SceneRenderer renderer{settings, support::cell_camera(), bar_arm()};
  const std::vector<DiscState> discs{disc_at(-0.05, 0.0, 0)};
  const Pose away = at(0.0, 5.0, 0.1), over = at(0.18, 0.0, 0.2);  // its shadow lies around x = -0.02, beside what it hides
  const auto lit = renderer.take(discs, 1, {&away, 1}), shaded = renderer.take(discs, 1, {&over, 1});
  for (const Vector3& p_W : {Vector3{0.0, 0.0, 0.0}, Vector3{-0.04, 0.0, 0.02}}) {
    const Vector2 pixel = *lit.camera.project(p_W);
    EXPECT_GT(colour_at(lit.color, pixel)[0], colour_at(shaded.color, pixel)[0] + 25) << p_W.transpose();
    EXPECT_EQ(depth_at(lit.depth, pixel), depth_at(shaded.depth, pixel));
  }
  const Vector2 far = *lit.camera.project({-0.3, 0.2, 0.0});
  EXPECT_EQ(colour_at(lit.color, far), colour_at(shaded.color, far));
}

TEST(CameraImage, AnArmAtTheLensIsDrawnWithoutHarm) {
  SceneRenderer renderer{plain_settings(), support::cell_camera(), bar_arm()};
  for (const double z : {0.75, 0.785, 0.80, 0.81, 1.0}) {
    const Pose pose = at(0.0, 0.0, z);
    const auto scene = renderer.take(rack_of_six({0.0, 0.0}), 1, {&pose, 1});
    const auto middle = colour_at(scene.color, {640, 360});
    if (z > 0.9) {
      EXPECT_GT(std::abs(middle[0] - middle[1]), 40) << "the disc, below a camera that does not see the bar behind it";
    }
  }
}

TEST(CameraImage, InTheDarkThereIsOnlyNoise) {
  SceneRenderer renderer;
  renderer.set_exposure({0.0, {1.0, 1.0, 1.0}});
  const auto dark = renderer.take(rack_of_six({0.0, 0.0}), 1);
  EXPECT_LT(mean_of(dark.color), 1.0);
  EXPECT_LT(*std::max_element(dark.color.rgb.begin(), dark.color.rgb.end()), 8);
  EXPECT_NEAR(depth_at(dark.depth, {100, 100}), 8000, 150);  // active stereo brings its own light
  renderer.set_exposure({});
  EXPECT_GT(mean_of(renderer.take(rack_of_six({0.0, 0.0}), 1).color), 100.0);
}

TEST(CameraImage, DiscsOffTheTableAreNotDrawn) {
  SceneRenderer renderer;
  auto gone = disc_at(0.0, 0.0, 0);
  gone.on_table = false;
  EXPECT_TRUE(same(renderer.take({&gone, 1}, 5), renderer.take({}, 5)));
}

TEST(CameraImage, ManyDiscsAndEveryHeightAreDrawn) {
  SceneRenderer renderer{plain_settings()};
  std::vector<DiscState> discs;
  for (int i = 0; i < 64; ++i) {
    auto disc = disc_at(-0.28 + 0.08 * (i % 8), -0.28 + 0.08 * (i / 8), static_cast<std::uint8_t>(i % 6));
    disc.height = 0.002 + 0.001 * i;
    discs.push_back(disc);
  }
  const auto scene = renderer.take(discs);
  for (const DiscState& disc : discs) {
    const auto pixel = scene.camera.project({disc.p_WD.x(), disc.p_WD.y(), disc.height});
    if (pixel->y() < 1 || pixel->y() > 718) continue;
    EXPECT_NEAR(depth_at(scene.depth, *pixel), 1e4 * (0.8 - disc.height), 1.5);
  }
}

TEST(CameraImage, SmallAndOddSizedImagesWork) {
  CameraModel model = support::cell_camera();
  model.width = 161;
  model.height = 91;
  model.fx = model.fy = 114.0;
  model.cx = 80.0;
  model.cy = 45.0;
  SceneRenderer renderer{plain_settings(), model};
  const auto disc = disc_at(0.0, 0.0, 0);
  const auto scene = renderer.take({&disc, 1});
  EXPECT_EQ(depth_at(scene.depth, {80, 45}), 7800);
  EXPECT_EQ(depth_at(scene.depth, {160, 90}), 8000);
}

TEST(CameraImage, RefusesWhatItCannotDraw) {
  CameraModel model = support::cell_camera();
  Camera camera{model, {}, bar_arm(), Pose::Identity()};
  std::vector<std::uint8_t> rgb(3 * 1280 * 720);
  std::vector<std::uint16_t> depth(1280 * 720);
  WorldSnapshot snapshot;
  EXPECT_THROW(camera.render(snapshot, 1, rgb, depth), CameraError) << "no pose for the link";
  snapshot.X_WL = {Pose::Identity()};
  EXPECT_NO_THROW(camera.render(snapshot, 1, rgb, depth));
  EXPECT_THROW(camera.render(snapshot, 1, std::span{rgb}.first(10), depth), CameraError);
  snapshot.discs = {disc_at(0.0, 0.0, 99)};
  EXPECT_THROW(camera.render(snapshot, 1, rgb, depth), CameraError) << "colour";
  snapshot.discs = {disc_at(std::nan(""), 0.0, 0)};
  EXPECT_THROW(camera.render(snapshot, 1, rgb, depth), CameraError) << "place";
  snapshot.discs = {disc_at(0.0, 0.0, 0, -0.03)};
  EXPECT_THROW(camera.render(snapshot, 1, rgb, depth), CameraError) << "radius";

  CameraSettings low_light;
  low_light.light.lamps[0].towards_W = {1.0, 0.0, 0.05};
  EXPECT_THROW(Camera(model, low_light, {}, Pose::Identity()), CameraError);
  model.X_WC.translation().z() = 0.05;
  EXPECT_THROW(Camera(model, {}, {}, Pose::Identity()), CameraError) << "a camera among the discs";
}

TEST(CameraDeathTest, WithoutEglItSaysWhatToInstall) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";  // a fresh process: EGL finds its drivers once
  EXPECT_EXIT(
      {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent", 1);
        try {
          const HeadlessContext context;
        } catch (const CameraError& error) {
          std::fputs(error.what(), stderr);
          _exit(3);
        }
        _exit(0);
      },
      testing::ExitedWithCode(3), "apt-get install libegl1");
}

/// CPU time of this thread, ms: a loaded machine does not count.
double cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Not a check: what a frame costs here and now.
TEST(CameraImage, ReportsItsCost) {
  Camera camera{support::cell_camera(), {}, bar_arm(), Pose::Identity()};
  std::vector<std::uint8_t> rgb(3 * 1280 * 720);
  std::vector<std::uint16_t> depth(1280 * 720);
  WorldSnapshot snapshot;
  snapshot.discs = rack_of_six({0.0, 0.0});
  for (const auto& [name, pose] :
       {std::pair{"six discs", at(0.0, 5.0, 0.1)}, std::pair{"six discs, arm over the table", at(-0.1, 0.1, 0.3)}}) {
    snapshot.X_WL = {pose};
    double best = 1e9;
    for (std::uint64_t i = 0; i < 10; ++i) {
      const double start = cpu_ms();
      camera.render(snapshot, i, rgb, depth);
      best = std::min(best, cpu_ms() - start);
    }
    std::printf("%s: %.1f ms of CPU per frame at best\n", name, best);
  }
}

}  // namespace
}  // namespace breakshot::sim_bridge
