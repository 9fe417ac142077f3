// Motion blur, and what a stereo camera gets wrong in depth.

#include "sim_bridge/camera/depth_flaws.hpp"
#include "sim_bridge/camera/motion.hpp"
#include "tests/sim_bridge/camera_picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace breakshot::sim_bridge {
namespace {

using support::disc_at;
using support::rack_of_six;
using support::RenderedScene;
using support::SceneRenderer;

bool same(const RenderedScene& a, const RenderedScene& b) { return a.color.rgb == b.color.rgb && a.depth.depth == b.depth.depth; }

/// How wide the step from the disc to the table is along +x, px: its area over its height. A sharp one has about a pixel.
double edge_width(const RenderedScene& scene, const DiscState& disc) {
  const Vector2 pixel = *scene.camera.project({disc.p_WD.x() + disc.radius, disc.p_WD.y(), disc.height});
  constexpr int kReach = 40;
  const auto at = [&](int offset) { return static_cast<double>(colour_at(scene.color, {std::round(pixel.x()) + offset, pixel.y()})[1]); };
  // The 10 and 90 % points of the way from the one to the other, between pixels.
  const double inside = at(-kReach), outside = at(kReach);
  const auto crossing = [&](double share) {
    for (int i = -kReach; i < kReach; ++i) {
      const double a = (at(i) - inside) / (outside - inside), b = (at(i + 1) - inside) / (outside - inside);
      if (a < share && b >= share) return i + (share - a) / (b - a);
    }
    return 0.0;
  };
  return (crossing(0.9) - crossing(0.1)) / 0.8;
}

CameraSettings blurred(double exposure) {
  CameraSettings settings = plain_settings();
  settings.exposure_time = exposure;
  return settings;
}

TEST(CameraMotion, BlurIsAsLongAsSpeedTimesExposure) {
  SceneRenderer renderer{blurred(0.008)};
  for (const double speed : {1.0, 2.0}) {
    auto disc = disc_at(0.0, 0.0, 2, 0.05);
    disc.v_WD_W = {speed, 0.0};
    const auto scene = renderer.take({&disc, 1});
    const double length = speed * 0.008 * 914.0 / 0.78;
    EXPECT_NEAR(edge_width(scene, disc), length, 0.12 * length + 0.6) << speed;
  }
}

TEST(CameraMotion, TheStampIsTheMiddleOfTheExposure) {
  SceneRenderer sharp{plain_settings()}, slow{blurred(0.010)};
  auto disc = disc_at(0.05, 0.02, 2);
  const auto still = sharp.take({&disc, 1});
  disc.v_WD_W = {0.8, 0.3};
  const auto moving = slow.take({&disc, 1});
  // Centroid of what is darker in green than the table is.
  const auto centroid = [](const RenderedScene& scene) {
    Vector2 sum = Vector2::Zero();
    double weight = 0.0;
    const double table = colour_at(scene.color, {5, 5})[1];
    for (int y = 200; y < 500; ++y) {
      for (int x = 500; x < 900; ++x) {
        const double w = std::max(0.0, table - 20.0 - colour_at(scene.color, {1.0 * x, 1.0 * y})[1]);
        sum += w * Vector2{1.0 * x, 1.0 * y};
        weight += w;
      }
    }
    return Vector2{sum / weight};
  };
  EXPECT_LT((centroid(moving) - centroid(still)).norm(), 0.35);
}

TEST(CameraMotion, WhatStandsStillIsNotBlurredNotOneBit) {
  SceneRenderer sharp, slow{[] {
    CameraSettings settings;
    settings.exposure_time = 0.02;
    return settings;
  }()};
  auto rack = rack_of_six({0.0, 0.0});
  EXPECT_TRUE(same(sharp.take(rack, 1), slow.take(rack, 1)));
  // One moves: far from it everything is as before.
  auto lone = disc_at(-0.35, 0.2, 1);
  lone.v_WD_W = {0.0, -0.5};
  rack.push_back(lone);
  const auto a = sharp.take(rack, 1), b = slow.take(rack, 1);
  EXPECT_FALSE(same(a, b));
  std::size_t different = 0;
  for (int y = 0; y < 720; ++y) {
    for (int x = 560; x < 1280; ++x) different += colour_at(a.color, {1.0 * x, 1.0 * y}) != colour_at(b.color, {1.0 * x, 1.0 * y}) ? 1 : 0;
  }
  EXPECT_EQ(different, 0U);
  rack.back().v_WD_W.setZero();
  EXPECT_TRUE(same(sharp.take(rack, 2), slow.take(rack, 2))) << "and nothing is left behind";
}

TEST(CameraMotion, AMovingArmIsBlurredAsItsLinksMove) {
  Shape bar;
  bar.size = {0.2, 0.1, 0.02};
  ArmDescription arm;
  arm.joints.resize(1);
  arm.links.resize(1);
  arm.links[0].visuals = {bar};
  Camera camera{support::cell_camera(), blurred(0.010), arm, Pose::Identity()};
  std::vector<std::uint8_t> still(3 * 1280 * 720), moving(still.size());
  std::vector<std::uint16_t> depth(1280 * 720);
  WorldSnapshot snapshot;
  snapshot.X_WL = {Pose{Eigen::Translation3d{0.0, 0.0, 0.2}}};
  camera.render(snapshot, 1, still, depth);
  snapshot.V_WL = {{Vector3::Zero(), {1.0, 0.0, 0.0}}};
  camera.render(snapshot, 1, moving, depth);
  // The edge at x = 0.1, 0.59 m below the lens: 15.5 px of blur, half of it on each side.
  const int edge = static_cast<int>(std::lround(639.5 + 0.1 * 914.0 / 0.59));
  const auto changed = [&](int x) {
    return std::abs(still[3 * (360U * 1280U + static_cast<unsigned>(x))] - moving[3 * (360U * 1280U + static_cast<unsigned>(x))]);
  };
  EXPECT_GT(changed(edge - 2), 5);
  EXPECT_GT(changed(edge + 2), 5);
  EXPECT_LE(changed(edge - 12), 1);
  EXPECT_LE(changed(edge + 12), 1);
  snapshot.V_WL = {{Vector3::Zero(), Vector3::Zero()}};
  camera.render(snapshot, 1, moving, depth);
  EXPECT_EQ(still, moving);
  snapshot.V_WL.resize(3);
  EXPECT_THROW(camera.render(snapshot, 1, moving, depth), CameraError);
}

TEST(CameraMotion, SamplesAreEvenAboutTheStamp) {
  for (const double px : {0.3, 5.0, 12.0, 100.0}) {
    const std::size_t samples = samples_for(px);
    EXPECT_EQ(samples % 4, 0U);
    EXPECT_LE(samples, 16U);
    double sum = 0.0;
    for (std::size_t i = 0; i < samples; ++i) sum += sample_time(i, samples);
    EXPECT_NEAR(sum, 0.0, 1e-12);
    EXPECT_LT(std::abs(sample_time(0, samples)), 0.5);
  }
}

/// A block at 0.5 m before a plane at 0.8 m.
constexpr int kWidth = 320, kHeight = 96, kLeft = 160, kRight = 220, kTop = 32, kBottom = 64;
std::vector<std::uint16_t> block_before_plane() {
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(kWidth * kHeight), 8000);
  for (int y = kTop; y < kBottom; ++y) {
    for (int x = kLeft; x < kRight; ++x) depth[static_cast<std::size_t>(y * kWidth + x)] = 5000;
  }
  return depth;
}

std::vector<std::uint16_t> flawed(const DepthFlawSettings& settings, std::uint64_t frame = 1, std::uint64_t seed = 1) {
  DepthFlaws flaws{settings, 914.0, 0.05, seed};
  TileGrid all{kWidth, kHeight};
  all.mark_all();
  const auto ideal = block_before_plane();
  std::vector<std::uint16_t> out(ideal.size());
  flaws.apply(ideal, kWidth, all, frame, out);
  return out;
}

TEST(CameraDepthFlaws, TheSecondCamerasShadowIsAsWideAsDisparitiesDiffer) {
  const auto depth = flawed({.shadow = true});
  const double width = 914.0 * 0.05 * (1.0 / 0.5 - 1.0 / 0.8);  // 34.3 px
  for (int y = 0; y < kHeight; ++y) {
    const bool beside = y >= kTop && y < kBottom;
    const auto row = depth.begin() + y * kWidth;
    const auto holes = std::count(row, row + kWidth, 0);
    EXPECT_NEAR(static_cast<double>(holes), beside ? width : 0.0, beside ? 1.0 : 0.0) << "row " << y;
    EXPECT_EQ(std::count(row + kLeft, row + kWidth, 0), 0) << "none on the block, none to its right";
    EXPECT_EQ(row[kLeft - 1] == 0, beside) << "right beside it";
  }
}

TEST(CameraDepthFlaws, HolesLieAtRimsInTheirShare) {
  const auto ideal = block_before_plane();
  int holes = 0, rim = 0;
  for (std::uint64_t frame = 0; frame < 40; ++frame) {
    const auto depth = flawed({.holes = 0.3}, frame);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto i = static_cast<std::size_t>(y * kWidth + x);
        const bool beside = ideal[i] == 8000 && x >= kLeft - 2 && x < kRight + 2 && y >= kTop - 2 && y < kBottom + 2;
        if (beside) {
          ++rim;
          holes += depth[i] == 0 ? 1 : 0;
        } else {
          ASSERT_EQ(depth[i], ideal[i]) << x << " " << y;
        }
      }
    }
  }
  EXPECT_NEAR(1.0 * holes / rim, 0.3, 0.03);
}

TEST(CameraDepthFlaws, TheNearerSurfaceBleedsOutAsFarAsItMay) {
  const auto ideal = block_before_plane();
  const auto depth = flawed({.bleed = 4.0});
  int farthest = 0, grown = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto i = static_cast<std::size_t>(y * kWidth + x);
      ASSERT_TRUE(depth[i] == ideal[i] || (ideal[i] == 8000 && depth[i] == 5000));
      if (depth[i] == ideal[i]) continue;
      ++grown;
      farthest = std::max({farthest, kLeft - x, x - kRight + 1, kTop - y, y - kBottom + 1});
    }
  }
  EXPECT_GT(grown, 100);
  EXPECT_LE(farthest, 4);
  EXPECT_GE(farthest, 3);
}

TEST(CameraDepthFlaws, SameSeedAndFrameSameFlaws) {
  const DepthFlawSettings settings{.shadow = true, .holes = 0.4, .bleed = 3.0};
  EXPECT_EQ(flawed(settings, 7, 2), flawed(settings, 7, 2));
  EXPECT_NE(flawed(settings, 7, 2), flawed(settings, 8, 2));
  EXPECT_NE(flawed(settings, 7, 2), flawed(settings, 7, 3));
  EXPECT_EQ(flawed({}), block_before_plane());
}

TEST(CameraDepthFlaws, APictureHasThemBesideItsDiscsOnly) {
  CameraSettings settings = plain_settings();
  SceneRenderer plain{settings};
  settings.depth_flaws = {.shadow = true, .holes = 0.5, .bleed = 3.0};
  SceneRenderer rough{settings};
  const auto disc = disc_at(0.1, 0.05, 0);
  const auto a = plain.take({&disc, 1}), b = rough.take({&disc, 1});
  EXPECT_EQ(a.color.rgb, b.color.rgb);
  int changed = 0;
  for (int y = 0; y < 720; ++y) {
    for (int x = 0; x < 1280; ++x) {
      const Vector2 pixel{1.0 * x, 1.0 * y};
      if (depth_at(a.depth, pixel) == depth_at(b.depth, pixel)) continue;
      ++changed;
      const double off = (a.camera.point_on_plane(pixel, 0.0) - disc.p_WD).norm();
      EXPECT_NEAR(off, disc.radius, 0.008) << x << " " << y;
    }
  }
  EXPECT_GT(changed, 50);
}

TEST(CameraDepthFlaws, RefusesSettingsOutOfRange) {
  EXPECT_THROW(DepthFlaws({.holes = 1.5}, 914.0, 0.05, 1), CameraError);
  EXPECT_THROW(DepthFlaws({.bleed = -1.0}, 914.0, 0.05, 1), CameraError);
  EXPECT_THROW(SceneRenderer{blurred(1.0)}, CameraError);
}

}  // namespace
}  // namespace breakshot::sim_bridge
