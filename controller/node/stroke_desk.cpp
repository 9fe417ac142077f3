#include "controller/node/stroke_desk.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace breakshot::control {

namespace {

constexpr Duration kPoll = std::chrono::milliseconds{2};
constexpr Duration kRepeat = std::chrono::milliseconds{20};  // 50 Hz
/// Requests that wait while one is planned; far more than a planner has reason to send.
constexpr std::size_t kMostRequests = 64;

}  // namespace

StrokeDesk::StrokeDesk(StrokeExecutor& executor, std::function<void(const StrokeStatus&)> send, std::function<Time()> now)
    : executor_{executor}, send_{std::move(send)}, now_{std::move(now)} {
  planning_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
  repeating_ = std::jthread{[this](const std::stop_token& stop) { repeat(stop); }};
}

StrokeDesk::~StrokeDesk() = default;

void StrokeDesk::submit(const StrokeRequest& request) {
  const std::lock_guard lock{mutex_};
  if (requests_.size() >= kMostRequests) {
    spdlog::warn("code=request_dropped stroke={} why=\"{} requests wait already\"", request.id, requests_.size());
    return;
  }
  requests_.push_back(request);
  work_.notify_all();
}

void StrokeDesk::report_foreign_commander() {
  const std::lock_guard lock{mutex_};
  foreign_ = true;
}

void StrokeDesk::close() {
  const std::lock_guard lock{mutex_};
  closing_ = true;
  work_.notify_all();
}

LoopStatus StrokeDesk::loop() const {
  const std::lock_guard lock{mutex_};
  return loop_;
}

void StrokeDesk::run(const std::stop_token& stop) {
  bool closed = false;
  std::vector<StrokeRequest> requests;
  while (!stop.stop_requested()) {
    bool close = false;
    bool foreign = false;
    {
      std::unique_lock lock{mutex_};
      work_.wait_for(lock, stop, kPoll, [&] { return !requests_.empty() || (closing_ && !closed); });
      requests.swap(requests_);
      foreign = std::exchange(foreign_, false);
      close = closing_ && !std::exchange(closed, closing_);
    }
    const Time now = now_();
    if (foreign) executor_.report_foreign_commander();
    if (close) executor_.close("the controller ends", now);
    for (const auto& request : requests) executor_.submit(request, now);
    requests.clear();
    executor_.poll(now);

    {
      const std::lock_guard sending{sending_};
      StrokeStatus status;
      while (executor_.next(status)) send_(status);
      const std::lock_guard lock{mutex_};
      loop_ = executor_.loop();
      newest_ = executor_.newest();
      const StrokeStatus* const following = executor_.following();
      following_ = following != nullptr ? std::optional{*following} : std::nullopt;
    }
  }
}

void StrokeDesk::repeat(const std::stop_token& stop) {
  std::mutex never;
  std::condition_variable_any tick;
  while (!stop.stop_requested()) {
    std::unique_lock lock{never};
    tick.wait_for(lock, stop, kRepeat, [] { return false; });
    const std::lock_guard sending{sending_};
    std::optional<StrokeStatus> status;
    std::optional<StrokeStatus> following;
    {
      const std::lock_guard held{mutex_};
      status = newest_;
      following = following_;
    }
    if (status) send_(*status);
    if (following) send_(*following);
  }
}

}  // namespace breakshot::control
