#pragma once

#include "common/scene.hpp"
#include "common/stroke.hpp"
#include "common/task.hpp"
#include "planner/estimate/restitution_estimate.hpp"
#include "planner/strategy/strategy.hpp"
#include "planner/task/crowd.hpp"
#include "planner/task/plan_ahead.hpp"
#include "planner/task/scene_watch.hpp"
#include "planner/task/stroke_link.hpp"
#include "planner/task/task_settings.hpp"

#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace breakshot::task {

/// Ask the controller. Sent again with the same id while it does not answer.
struct SendStroke {
  StrokeRequest stroke;
};

/// Run the strategy on a scene and answer with on_decision(ticket, ...). Only the newest ticket counts: what runs for an older one is to be given up
/// (DecisionContext::stop).
struct RunStrategy {
  std::uint64_t ticket = 0;
  Scene scene;
  strategy::DecisionContext context;              ///< filter, belief and stop are the caller's to add
  std::vector<strategy::StrokeOption> earlier{};  ///< not empty: Strategy::revise() these
};

/// What a task wants done, in order. TaskStatus: publish it, something changed. ObservedHit: learn from it.
using Action = std::variant<SendStroke, RunStrategy, Plan, Outcome, estimate::ObservedHit, TaskStatus>;

/// Runs one task at a time to its end: look, decide, act, look again, until singulated or given up for a stated reason.
///
/// Pure: events come in with the time of the cell clock, actions come out; no threads, no clock, no DDS, so tests play a whole cell in
/// microseconds. Call on_tick() at least at 10 Hz, and take_actions() after every event. Not thread-safe.
///
/// Times: `look` is from the first word of the task, or from a table that came to rest, to a scene to decide on; `decide` the strategy's
/// thinking; `move` from the request of a stroke until the discs are free; `settle` from then until the first scene at rest. Pauses count
/// nowhere, neither as time nor towards the timeout.
///
/// The next decision begins while the arm still moves or discs still slide, on a forecast of the scene (PlanAhead); it counts only once the scene has
/// settled and agrees.
///
/// A stroke that the controller stops ends the task, whatever the cause: nothing is to move after a stop before somebody has recovered the controller
/// and given a fresh order.
class TaskRunner {
 public:
  /// @param first_stroke_id  above every id that an earlier life of the planner may have used
  /// @param knowledge  for forecasts of where sliding discs come to rest
  TaskRunner(const TaskSettings& settings, std::string strategy_name, std::uint64_t first_stroke_id = 1,
             const strategy::StrategySettings& knowledge = {});

  /// A request that was taken before (same seq) is ignored: it was sent again because our status was late. A start while another order runs
  /// is left unacknowledged, so it is sent again and taken when that order has ended. A recovery while an order runs is acknowledged and not done.
  void on_request(const TaskRequest& request, Time now);
  void on_scene(const Scene& scene, Time now);
  /// What has been learnt of the table, for forecasts; before the first, what the knowledge says counts.
  void on_belief(const strategy::TableBelief& belief) noexcept { belief_ = belief; }
  void on_stroke_status(const StrokeStatus& status, Time now);
  void on_decision(std::uint64_t ticket, strategy::Decision decision, Duration think, Time now);
  /// @param real  time since the last call by a clock that others live by as well. Patience with them counts the shorter of the two: in lockstep
  ///              the cell clock runs many times as fast as processes on a busy machine can answer
  void on_tick(Time now, Duration real = Duration::max());
  /// The cell clock stands still (lockstep: simulator, camera or controller are gone), seen by somebody with another clock.
  void on_clock_stopped(Time now);

  std::vector<Action> take_actions();
  /// Whether it looks at scenes that are exposed now.
  bool watches_table() const noexcept;
  /// Of all tasks so far.
  const AheadCounts& ahead_counts() const noexcept { return ahead_.counts(); }
  /// As of the last event.
  const TaskStatus& status() const noexcept { return status_; }
  bool running() const noexcept { return status_.phase != TaskPhase::kIdle && !is_final(status_.phase); }

 private:
  /// How a task is to end once the stroke under way is over and the arm is parked.
  struct End {
    TaskPhase phase = TaskPhase::kFailed;
    TaskFailure failure = TaskFailure::kNone;
    std::string text;
  };

  static constexpr std::size_t kTextLimit = 255;  // TaskStatus::text, Plan::why

  void advance(Time now) noexcept;
  void set_phase(TaskPhase phase, std::string text);
  void publish_status();

  /// A status with nothing in it but whose task it is.
  void begin_status(const TaskRequest& request);
  void start(const TaskRequest& request, Time now);
  void look(Time now);
  void judge(const Scene& scene, Time now);
  /// How a scene contradicts the one that is being decided on, for people; empty when it does not.
  std::string change_while_deciding(const Scene& scene) const;
  bool count_is_right(const Scene& scene);
  void think_ahead(const Scene& scene);
  void conclude(Time now);
  void use_ahead(Time now);
  void ask_strategy(std::vector<strategy::StrokeOption> earlier = {});
  strategy::DecisionContext context() const;
  void decided(strategy::Decision decision, Duration think, Time now);
  /// More discs than fit the region: says so. @return whether that is the end, for nothing more is gained
  bool gives_up_on_crowd(Time now);
  void forget_decision();
  void look_again(const std::string& why, Time now);
  void try_next_option(Time now);
  void send(const StrokeRequest& stroke, Time now);
  void drop_waiting_stroke();
  void start_recovery(const TaskRequest& request, Time now);
  void stroke_over(Time now);
  void recovery_over(Time now);
  void refused(const StrokeStatus& status, Time now);
  void emit_outcome(const StrokeStatus& status);

  void end_with(End end, Time now);
  void fail(TaskFailure failure, std::string text, Time now);
  void finish(const End& end, Time now);

  TaskSettings settings_;
  std::string strategy_name_;
  std::vector<Action> actions_;

  TaskRequest task_;
  TaskStatus status_;
  std::optional<End> ending_;
  bool pause_asked_ = false;
  bool parked_ = false;         // the last stroke ended with the arm parked
  bool parked_before_ = false;  // the same before the stroke under way
  Time last_tick_{};
  Time accounted_to_{};
  Duration unpaused_{};  // time spent on the task without pauses

  SceneWatch watch_;
  Scene scene_;  // the one decided on
  std::uint32_t discs_known_ = 0;
  std::uint32_t contacts_left_ = 0;
  std::string crowd_;        // that there are more discs than fit the region; empty when there are not
  Spacing best_;             // with a crowd: that there was so far
  int in_vain_ = 0;          // and strokes in a row that did not better it
  PhaseTimes times_before_;  // at the last look's beginning

  double position_sigma_;  // of a place, beside its covariance, m
  PlanAhead ahead_;
  strategy::TableBelief belief_;
  PlanAhead::Verdict ahead_verdict_ = PlanAhead::Verdict::kNone;  // while its answer is waited for
  std::string ahead_note_;                                        // what the plan is to say of what was decided ahead
  std::optional<StrokeRequest> corrected_;                        // first choice of the decision that is being corrected
  Duration think_ahead_{};                                        // that it took
  std::uint64_t ticket_ = 0;
  std::uint64_t decisions_ = 0;
  std::vector<strategy::StrokeOption> options_;
  std::size_t option_ = 0;  // the next one to try
  Duration think_{};        // that they took
  double hit_speed_cap_ = 1e9;

  StrokeLink link_;
  std::uint64_t plans_ = 0;
  std::optional<StrokeStatus> outcome_due_;  // of a stroke whose result has not been seen yet
  StrokeRequest stroke_run_;                 // that stroke
};

}  // namespace breakshot::task
