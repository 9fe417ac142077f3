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
/// One stroke runs at a time, and one more may be known already: then the arm goes over into it without a rest. It has no thread and no clock
/// of its own: its owner calls submit(), cancel() and poll() from one thread and takes the status values out. It
/// owns the trajectory buffers, allocated once.
class StrokeExecutor {
 public:
  /// @param planner   plans from any set-point; used by this object alone as long as it lives
  /// @param channels  this side of them is the executor's alone
  StrokeExecutor(motion::StrokePlanner& planner, LoopChannels& channels);

  /// A request has come. Every request gets at least one status, sooner or later a final one.
  ///
  /// - The same request again (same id and content) as the present or a recent one: its last status once more, and nothing else.
  /// - A hit or a push while another one is under way follows it without a rest in between: it takes over where that one has left the discs, which
  ///   ends that one as kDone without its way to the park pose or to rest. When that cannot be any more, it starts from rest. When the one before
  ///   it is stopped, it is refused as kStopped.
  /// - Any further one, another one with the same id, and a recovery: kBusy, as is everything while a park or a recovery is under way; but a park
  ///   request stops the stroke on its path and then parks.
  /// - Without fresh joint states: kNotReady.
  /// - After a stop: kStopped, until a StrokeKind::kRecover was done. Only a stop that a park request brought about ends with that request: it
  ///   is the same commander's wish.
  /// - kRecover waits a while for the arm to rest and for the causes to be gone; when that does not come true, kNotReady says what is in the way.
  ///   With nothing stopped it is done at once.
  void submit(const StrokeRequest& request, Time now);

  /// Stops whatever moves, on its path. The stroke under way ends as kStopped, or kRefused when it has not begun; the one after it as kRefused.
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

  /// Status of the stroke after it, for the same; null: none is to follow.
  const StrokeStatus* following() const noexcept { return following_ && following_->told ? &following_->status : nullptr; }

  bool idle() const noexcept { return stage_ == Stage::kIdle && !following_; }
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
  /// The stroke after the one under way.
  struct Following {
    explicit Following(const StrokeRequest& asked) : request{asked} {}

    StrokeRequest request;
    StrokeStatus status;
    bool told = false;                               ///< the status was sent
    const motion::Trajectory* trajectory = nullptr;  ///< that the loop has; null: it has none
    std::uint64_t number = 0;                        ///< of it, LoopRequest::trajectory_number
    Duration plan_ahead{};                           ///< planning and the way to the loop may take so long
    std::size_t not_before = 0;                      ///< tick of the running trajectory: earlier joins were tried in vain
    int attempts = 0;                                ///< to find a way from a join
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
  /// Plans the following stroke into the running one, once that is possible; or begins it when there is nothing under way any more.
  void carry_on(Time now);
  /// The following stroke has no plan.
  void wait_in_line(Time now);
  void plan_join(Time now);
  /// Tick of the running trajectory, from `earliest` on, from which another one may take over: the discs are free and the arm moves.
  std::optional<std::size_t> find_join(std::size_t earliest) const noexcept;
  /// Fills in what a plan gave, and hands the trajectory to the loop.
  void hand_over(StrokeStatus& status, const motion::StrokeTimes& times, LoopRequest::Join join, Time now);
  /// The following stroke has become the one under way.
  void take_over();
  void refuse_following(RefusalReason reason, const std::string& text, Time now);
  void handle_following(const LoopEvent& event);
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
  StrokeRequest request_;                        ///< of the stroke under way
  StrokeStatus status_;                          ///< of the stroke under way
  const motion::Trajectory* running_ = nullptr;  ///< of the stroke under way, when the loop has it
  std::uint64_t running_number_ = 0;             ///< of it, LoopRequest::trajectory_number
  std::optional<Following> following_;
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
