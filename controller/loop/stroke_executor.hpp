#pragma once

#include "common/stroke.hpp"
#include "controller/loop/channels.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "controller/motion/trajectory.hpp"

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::control {

/// The planning side of the controller: turns stroke requests into trajectories for the loop, and what the loop tells into stroke status.
///
/// One stroke at a time. It has no thread and no clock of its own: its owner calls submit(), cancel() and poll() from one thread and takes the
/// status values out. It owns the trajectory buffers, allocated once.
class StrokeExecutor {
 public:
  /// @param planner   plans from any set-point; used by this object alone as long as it lives
  /// @param channels  this side of them is the executor's alone
  StrokeExecutor(motion::StrokePlanner& planner, LoopChannels& channels);

  /// A request has come. Every request gets at least one status, sooner or later a final one.
  ///
  /// - The same request again (same id and content) as the present or a recent one: its last status once more, and nothing else.
  /// - While another stroke is under way: kBusy; but a park request stops that stroke on its path and then parks.
  /// - Without fresh joint states: kNotReady.
  /// - After a stop: kStopped, until a StrokeKind::kRecover was done. Only a stop that a park request brought about ends with that request: it
  ///   is the same commander's wish.
  /// - kRecover waits a while for the arm to rest and for the causes to be gone; when that does not come true, kNotReady says what is in the way.
  ///   With nothing stopped it is done at once.
  void submit(const StrokeRequest& request, Time now);

  /// Stops whatever moves, on its path. The stroke under way ends as kStopped, or kRefused when it has not begun.
  void cancel(const std::string& why, Time now);

  /// cancel(), and from now on every request is refused.
  void close(const std::string& why, Time now);

  /// Commands of somebody else were seen on their way to the drives.
  void report_foreign_commander() { channels_.requests.push({.kind = LoopRequest::Kind::kForeignCommander}); }

  /// Until the loop has been ready for the first time, whatever stops it belongs to the start and is ended without being asked: nobody has moved
  /// anything yet.
  ///
  /// Takes in what the loop has told since the last call, and carries on. Planning happens in here (tens of milliseconds). Call it every few
  /// milliseconds of the cell clock.
  void poll(Time now);

  /// The next status to be sent, oldest first; false when there is none.
  bool next(StrokeStatus& out);
  /// Status of the newest stroke, for the periodic repetition.
  const std::optional<StrokeStatus>& newest() const noexcept { return newest_; }

  bool idle() const noexcept { return stage_ == Stage::kIdle; }
  /// Of the loop, as of the last poll() or submit().
  const LoopStatus& loop() const noexcept { return loop_; }
  /// Called from poll() with every event of the loop, for the log.
  void observe_events(std::function<void(const LoopEvent&)> observer) { observer_ = std::move(observer); }
  /// Called from poll() with every trajectory and its number (LoopRequest::trajectory_number), just before the loop gets it.
  void observe_trajectories(std::function<void(std::uint64_t, const motion::Trajectory&)> observer) {
    trajectory_observer_ = std::move(observer);
  }

 private:
  enum class Stage : std::uint8_t {
    kIdle,
    kWaiting,  ///< for the loop to be ready for planning, or to recover
    kHanded,   ///< the loop has the trajectory
  };
  struct Remembered {
    StrokeRequest request;
    StrokeStatus status;
    Time ended{};
  };

  void handle(const LoopEvent& event);
  void begin(const StrokeRequest& request, Time now);
  /// Whether a stop is in the way of a request that is to move something.
  bool stop_bars(const StrokeRequest& request) const noexcept;
  void wait_or_plan(Time now);
  void wait_for_recovery(Time now);
  /// Asks the loop to recover once it may, and again after it could not.
  void ask_to_recover();
  void start_up();
  void plan(Time now);
  void refuse(const StrokeRequest& request, RefusalReason reason, const std::string& text, Time now);
  void send(StrokeStatus status);
  void finish(StrokePhase phase, RefusalReason reason, const std::string& text, Time now);
  bool repeats(const StrokeRequest& request, Time now);
  std::string why_not_ready() const;
  std::string why_not_recovered() const;

  motion::StrokePlanner& planner_;
  LoopChannels& channels_;
  std::vector<std::unique_ptr<motion::Trajectory>> buffers_;
  std::vector<motion::Trajectory*> free_;
  LoopStatus loop_;
  std::function<void(const LoopEvent&)> observer_;
  std::function<void(std::uint64_t, const motion::Trajectory&)> trajectory_observer_;
  std::uint64_t handed_ = 0;  ///< trajectories given to the loop so far

  Stage stage_ = Stage::kIdle;
  StrokeRequest request_;              ///< of the stroke under way
  StrokeStatus status_;                ///< of the stroke under way
  std::optional<StrokeRequest> next_;  ///< a park request that waits for the stroke under way to stop
  std::string closed_;                 ///< why every request is refused; empty: it is not
  Time wait_until_{};
  bool started_up_ = false;  ///< the loop has been ready
  bool recovery_sent_ = false;
  safety::CauseSet ended_;  ///< by the recovery under way
  std::string details_;     ///< of the newest safety event of the stroke under way that came with figures

  std::deque<StrokeStatus> outbox_;
  std::optional<StrokeStatus> newest_;
  std::deque<Remembered> remembered_;  ///< strokes that ended lately, newest last
};

}  // namespace breakshot::control
