#include "sim_bridge/node/camera_feed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <numeric>
#include <vector>

namespace breakshot::sim_bridge {
namespace {

using std::chrono::milliseconds;

CameraModel small_camera() {
  CameraModel model;
  model.width = 160;
  model.height = 90;
  model.fx = model.fy = 114.0;
  model.cx = 79.5;
  model.cy = 44.5;
  model.X_WC.linear() = Eigen::Vector3d{1.0, -1.0, -1.0}.asDiagonal();
  model.X_WC.translation() << 0.0, 0.0, 0.8;
  return model;
}

Shot shot_at(std::uint64_t seq, Time stamp, double x) {
  Shot shot;
  shot.snapshot.stamp = stamp;
  shot.snapshot.discs = {DiscState{.p_WD = {x, 0.0}}};
  shot.seq = seq;
  shot.due = stamp + milliseconds{66};
  return shot;
}

double brightness(const ColorFrame& frame) {
  return std::accumulate(frame.rgb.begin(), frame.rgb.end(), 0.0) / static_cast<double>(frame.rgb.size());
}

/// Collects what the feed publishes.
class CameraFeedTest : public testing::Test {
 protected:
  CameraFeed::Publish collect() {
    return [this](const ColorFrame& color, const DepthFrame& depth) {
      const std::lock_guard lock{mutex};
      EXPECT_EQ(color.seq, depth.seq);
      frames.push_back(color);
    };
  }
  std::size_t size() {
    const std::lock_guard lock{mutex};
    return frames.size();
  }

  std::mutex mutex;
  std::vector<ColorFrame> frames;
};

TEST_F(CameraFeedTest, LockstepPublishesExactlyWhatIsDue) {
  CameraFeed feed{CameraFeed::Mode::kLockstep, small_camera(), CameraSettings{}, ArmDescription{}, Pose::Identity(), collect()};
  Time now = time_from_ns(1'000'000'000);
  std::uint64_t seq = 0;
  for (int i = 0; i < 500; ++i) {
    if (i % 33 == 0) feed.expose(shot_at(++seq, now, 0.001 * i));
    feed.pass(now);
    const std::size_t due = i < 66 ? 0 : static_cast<std::size_t>((i - 66) / 33 + 1);
    ASSERT_EQ(size(), due) << "tick " << i;
    now += milliseconds{1};
  }
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i].seq, i + 1);
}

TEST_F(CameraFeedTest, DarkAndFrozenPicturesLookIt) {
  CameraFeed feed{CameraFeed::Mode::kLockstep, small_camera(), CameraSettings{}, ArmDescription{}, Pose::Identity(), collect()};
  const Time t = time_from_ns(1'000'000'000);
  feed.expose(shot_at(1, t, 0.0));
  Shot frozen = shot_at(2, t + milliseconds{33}, 0.1);
  frozen.frozen = true;
  feed.expose(frozen);
  Shot dark = shot_at(3, t + milliseconds{66}, 0.1);
  dark.brightness = 0.0;
  feed.expose(dark);
  feed.expose(shot_at(4, t + milliseconds{99}, 0.1));
  feed.pass(t + milliseconds{200});
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[1].rgb, frames[0].rgb);
  EXPECT_NE(frames[1].exposed, frames[0].exposed);
  EXPECT_LT(brightness(frames[2]), 10.0);
  EXPECT_GT(brightness(frames[3]), 50.0);
}

TEST_F(CameraFeedTest, AMovedCameraSeesTheSameFromElsewhereAndComesBack) {
  CameraFeed feed{CameraFeed::Mode::kLockstep, small_camera(), CameraSettings{}, ArmDescription{}, Pose::Identity(), collect()};
  const Time t = time_from_ns(1'000'000'000);
  for (std::uint64_t i = 0; i < 3; ++i) {
    Shot shot = shot_at(7, t + static_cast<std::int64_t>(i) * milliseconds{33}, 0.0);
    shot.moved = i == 1 ? 0.05 : 0.0;
    feed.expose(shot);
  }
  feed.pass(t + milliseconds{200});
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_NE(frames[1].rgb, frames[0].rgb);
  EXPECT_EQ(frames[2].rgb, frames[0].rgb);
  // The disc is 7 px aside: 50 mm of 0.8 m at a focal length of 114 px.
  const auto red_at = [&](const ColorFrame& frame, int x) {
    return frame.rgb[static_cast<std::size_t>(3 * (44 * 160 + x))] - frame.rgb[static_cast<std::size_t>(3 * (44 * 160 + x) + 2)];
  };
  EXPECT_GT(red_at(frames[0], 83), 60);
  EXPECT_LT(red_at(frames[1], 83), 60);
  EXPECT_GT(red_at(frames[1], 83 - 7), 60);
}

TEST_F(CameraFeedTest, ABadSnapshotIsAFailureWithAReasonAndNothingHangs) {
  CameraFeed feed{CameraFeed::Mode::kLockstep, small_camera(), CameraSettings{}, ArmDescription{}, Pose::Identity(), collect()};
  Shot shot = shot_at(1, time_from_ns(1'000'000'000), 0.0);
  shot.snapshot.discs[0].colour = 200;
  feed.expose(shot);
  feed.pass(time_from_ns(2'000'000'000));
  EXPECT_TRUE(feed.failure());
  EXPECT_EQ(size(), 0U);
}

TEST_F(CameraFeedTest, EndsWithPicturesOnTheirWay) {
  CameraFeed feed{CameraFeed::Mode::kRealTime, small_camera(), CameraSettings{}, ArmDescription{}, Pose::Identity(), collect()};
  // Due in an hour by any clock.
  for (std::uint64_t i = 1; i < 10; ++i) {
    Shot shot = shot_at(i, Time{std::chrono::steady_clock::now().time_since_epoch()}, 0.0);
    shot.due += std::chrono::hours{1};
    feed.expose(shot);
  }
}

}  // namespace
}  // namespace breakshot::sim_bridge
