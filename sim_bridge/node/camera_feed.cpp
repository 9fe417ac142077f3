#include "sim_bridge/node/camera_feed.hpp"

#include <pthread.h>

#include <algorithm>

namespace breakshot::sim_bridge {
namespace {

/// Shots that wait to be rendered. More than this is never caught up with.
constexpr std::size_t kMostWaiting = 3;
/// The monotonic clock is looked at this often while a frame waits to become due and nothing else happens.
constexpr Duration kLook = std::chrono::milliseconds{20};

/// CLOCK_MONOTONIC, which is the cell clock in real-time mode.
Time monotonic_now() noexcept { return Time{std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch())}; }

}  // namespace

CameraFeed::CameraFeed(Mode mode, const CameraModel& model, const CameraSettings& settings, const ArmDescription& arm, const Pose& X_WB,
                       Publish publish)
    : mode_{mode},
      settings_{settings},
      model_{model},
      arm_{arm},
      X_WB_{X_WB},
      camera_{model, settings, arm, X_WB},
      publish_{std::move(publish)},
      brightness_{settings.exposure.brightness} {
  thread_ = std::thread{[this] { run(); }};
}

CameraFeed::~CameraFeed() {
  {
    const std::lock_guard lock{mutex_};
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void CameraFeed::expose(Shot shot) {
  {
    const std::lock_guard lock{mutex_};
    if (failure_) return;
    if (mode_ == Mode::kRealTime && shots_.size() == kMostWaiting) {
      shots_.pop_front();
      ++dropped_;
    }
    shots_.push_back(std::move(shot));
  }
  changed_.notify_all();
}

void CameraFeed::pass(Time now) {
  std::unique_lock lock{mutex_};
  now_ = now;
  const auto all_out = [&] {
    const auto later = [&](const auto& each) { return each.due > now; };
    return stop_ || failure_ ||
           (std::all_of(shots_.begin(), shots_.end(), later) && std::all_of(ready_.begin(), ready_.end(), later) &&
            (!in_work_ || *in_work_ > now));
  };
  if (all_out()) return;
  changed_.notify_all();
  changed_.wait(lock, all_out);
}

std::uint64_t CameraFeed::published() const {
  const std::lock_guard lock{mutex_};
  return published_;
}

std::uint64_t CameraFeed::dropped() const {
  const std::lock_guard lock{mutex_};
  return dropped_;
}

std::optional<std::string> CameraFeed::failure() const {
  const std::lock_guard lock{mutex_};
  return failure_;
}

Time CameraFeed::clock() const { return mode_ == Mode::kRealTime ? monotonic_now() : now_; }

CameraFeed::Frame CameraFeed::take_free_frame() {
  if (free_.empty()) return {};
  Frame frame = std::move(free_.back());
  free_.pop_back();
  return frame;
}

void CameraFeed::run() {
  pthread_setname_np(pthread_self(), "camera");
  std::unique_lock lock{mutex_};
  while (!stop_) {
    if (!ready_.empty() && clock() >= ready_.front().due) {
      Frame frame = std::move(ready_.front());
      ready_.pop_front();
      in_work_ = frame.due;
      lock.unlock();
      publish_(frame.color, frame.depth);
      lock.lock();
      in_work_.reset();
      if (last_) free_.push_back(std::move(*last_));
      last_ = std::move(frame);
      ++published_;
      changed_.notify_all();
    } else if (!shots_.empty()) {
      const Shot shot = std::move(shots_.front());
      shots_.pop_front();
      Frame frame = take_free_frame();
      in_work_ = shot.due;
      lock.unlock();
      std::optional<std::string> failure;
      try {
        render(shot, frame);
      } catch (const std::exception& error) {
        failure = error.what();
      }
      lock.lock();
      in_work_.reset();
      failure_ = failure;
      if (!failure) ready_.push_back(std::move(frame));
      if (failure) {
        changed_.notify_all();
        return;
      }
    } else if (ready_.empty() || mode_ == Mode::kLockstep) {
      changed_.wait(lock);
    } else {
      changed_.wait_for(lock, std::min<Duration>(kLook, ready_.front().due - clock()));
    }
  }
}

void CameraFeed::render(const Shot& shot, Frame& frame) {
  const auto pixels = static_cast<std::size_t>(model_.width) * static_cast<std::size_t>(model_.height);
  frame.due = shot.due;
  frame.color.seq = frame.depth.seq = shot.seq;
  frame.color.exposed = frame.depth.exposed = shot.snapshot.stamp;
  frame.color.width = frame.depth.width = model_.width;
  frame.color.height = frame.depth.height = model_.height;
  frame.color.rgb.resize(3 * pixels);
  frame.depth.depth.resize(pixels);
  const Frame* before = ready_.empty() ? (last_ ? &*last_ : nullptr) : &ready_.back();
  if (shot.frozen && before != nullptr) {
    frame.color.rgb = before->color.rgb;
    frame.depth.depth = before->depth.depth;
    return;
  }
  if (shot.moved != moved_) {
    // Everything that was drawn once is drawn from elsewhere: half a second, which for a moment costs frames in real-time mode.
    CameraSettings settings = settings_;
    settings.move.by_W.x() += shot.moved;
    camera_ = Camera{model_, settings, arm_, X_WB_};
    moved_ = shot.moved;
    brightness_ = settings_.exposure.brightness;
  }
  if (shot.brightness != brightness_) {
    Exposure light = settings_.exposure;
    light.brightness = shot.brightness;
    camera_.set_exposure(light);
    brightness_ = shot.brightness;
  }
  camera_.render(shot.snapshot, shot.seq, frame.color.rgb, frame.depth.depth);
}

}  // namespace breakshot::sim_bridge
