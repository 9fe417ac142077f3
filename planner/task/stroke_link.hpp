#pragma once

#include "common/stroke.hpp"
#include "planner/task/task_settings.hpp"

#include <optional>

namespace breakshot::task {

/// One stroke on its way through the controller: sent, sent again while nobody answers, followed until it is final.
class StrokeLink {
 public:
  explicit StrokeLink(const TaskSettings& settings, std::uint64_t first_id) : settings_{settings}, next_id_{first_id} {}

  /// Gives the stroke the next id; the caller sends it. Ends whatever was under way.
  const StrokeRequest& begin(StrokeRequest stroke, Time now);
  void end() noexcept { active_ = false; }
  bool active() const noexcept { return active_; }
  const StrokeRequest& request() const noexcept { return request_; }
  /// The newest word about the stroke; nothing before the first.
  const std::optional<StrokeStatus>& status() const noexcept { return status_; }

  /// Takes a status. @return whether it is about the stroke under way, and news
  bool on_status(const StrokeStatus& status);

  enum class Need : std::uint8_t {
    kNothing,
    kSend,    ///< request() is to be sent again: no answer yet, or the controller was busy or not ready (then it has a new id)
    kGiveUp,  ///< the controller was silent, busy or not ready for too long
  };
  /// @param passed  time since the last check in which the controller could have answered (TaskRunner::on_tick)
  Need check(Time now, Duration passed);
  /// Refused for now only: the controller may take the same stroke later, and check() will say when to ask again.
  bool waits() const noexcept {
    return status_ && status_->phase == StrokePhase::kRefused &&
           (status_->reason == RefusalReason::kBusy || status_->reason == RefusalReason::kNotReady);
  }

 private:
  TaskSettings settings_;
  std::uint64_t next_id_;
  bool active_ = false;
  StrokeRequest request_;
  std::optional<StrokeStatus> status_;
  Time sent_{};
  Duration silent_{};  // since the last status, or begin()
  Duration unwell_{};  // since begin(), or the last status that was not "busy" or "not ready"
};

}  // namespace breakshot::task
