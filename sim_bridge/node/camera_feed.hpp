#pragma once

#include "common/frames.hpp"
#include "sim_bridge/camera/camera.hpp"
#include "sim_bridge/world_snapshot.hpp"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace breakshot::sim_bridge {

/// One picture to take: what was before the camera when it was exposed, and when it is to be on its topic.
struct Shot {
  WorldSnapshot snapshot;
  std::uint64_t seq = 0;
  Time due{};
  double brightness = 1.0;  ///< of the light
  double moved = 0.0;       ///< how far the camera stands aside of where it was built in, along x of W, m
  bool frozen = false;      ///< deliver the last picture again, under this one's number and stamp
};

/// Takes pictures in a thread of its own and publishes each when it is due.
///
/// Real-time mode: due by the monotonic clock; when rendering cannot keep up, the oldest shots are dropped and counted. Lockstep mode: due by
/// the world's clock, which pass() moves on and holds until every frame that is due is out.
class CameraFeed {
 public:
  enum class Mode { kRealTime, kLockstep };
  using Publish = std::function<void(const ColorFrame&, const DepthFrame&)>;

  /// Starts GL. @throws CameraError
  CameraFeed(Mode mode, const CameraModel& model, const CameraSettings& settings, const ArmDescription& arm, const Pose& X_WB,
             Publish publish);
  ~CameraFeed();
  CameraFeed(const CameraFeed&) = delete;
  CameraFeed& operator=(const CameraFeed&) = delete;
  CameraFeed(CameraFeed&&) = delete;
  CameraFeed& operator=(CameraFeed&&) = delete;

  /// Never waits.
  void expose(Shot shot);
  /// Lockstep mode: the world's clock has come to `now`. Waits until all frames due by then are published.
  void pass(Time now);

  std::uint64_t published() const;
  std::uint64_t dropped() const;
  /// Set once rendering failed: why. No frames come after that.
  std::optional<std::string> failure() const;

 private:
  struct Frame {
    ColorFrame color;
    DepthFrame depth;
    Time due{};
  };

  void run();
  void render(const Shot& shot, Frame& frame);
  Time clock() const;
  Frame take_free_frame();

  Mode mode_;
  CameraSettings settings_;
  CameraModel model_;
  ArmDescription arm_;
  Pose X_WB_;
  Camera camera_;
  Publish publish_;
  double brightness_;
  double moved_ = 0.0;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Shot> shots_;
  std::deque<Frame> ready_;    // pushed and popped by the feed's thread alone
  std::optional<Frame> last_;  // published last
  std::vector<Frame> free_;
  std::optional<Time> in_work_;  // due time of the frame that is being rendered or published
  Time now_{};                   // lockstep mode
  bool stop_ = false;
  std::uint64_t published_ = 0;
  std::uint64_t dropped_ = 0;
  std::optional<std::string> failure_;
  std::thread thread_;
};

}  // namespace breakshot::sim_bridge
