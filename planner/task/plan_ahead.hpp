#pragma once

#include "common/scene.hpp"
#include "planner/strategy/strategy.hpp"
#include "planner/task/rest_forecast.hpp"
#include "planner/task/scene_change.hpp"
#include "planner/task/task_settings.hpp"

#include <optional>
#include <string>
#include <vector>

namespace breakshot::task {

/// What became of decisions that were begun before the scene had settled.
struct AheadCounts {
  std::uint32_t kept = 0;       ///< the scene settled as foreseen, within what the camera errs by
  std::uint32_t corrected = 0;  ///< as foreseen within what the forecast may err by: strokes were scored anew
  std::uint32_t dropped = 0;    ///< otherwise, or there was nothing left to do
  std::uint32_t renewed = 0;    ///< thrown away already before the scene settled, for a better forecast

  AheadCounts& operator+=(const AheadCounts& other) noexcept {
    kept += other.kept;
    corrected += other.corrected;
    dropped += other.dropped;
    renewed += other.renewed;
    return *this;
  }
};

/// The decision about the next stroke, begun on a forecast of the scene while discs still slide or the arm still moves.
///
/// Nothing that it holds is ever acted upon before the scene has settled and agrees with the forecast. Pure, as the task is.
class PlanAhead {
 public:
  PlanAhead(const TaskSettings& settings, const strategy::StrategySettings& knowledge);

  /// From now on the discs are free: what a camera exposes after `now` counts. What was decided before does not.
  void start(Time now);
  /// The arm is about to touch the discs, or nobody wants a decision: nothing is begun, what was begun is dropped.
  void stop();
  bool started() const noexcept { return since_.has_value(); }

  /// A decision to be begun.
  struct Question {
    Scene scene;
    std::vector<strategy::StrokeOption> earlier;  ///< not empty: these are to be corrected for the scene
  };
  /// Takes the next scene. @return what to ask the strategy now, if anything; taken by asked()
  /// @param discs  that there are; 0: as many as this scene shows
  std::optional<Question> on_scene(const Scene& scene, std::size_t discs, double min_gap, const Rect& region,
                                   const strategy::TableBelief& belief);
  void asked(const Question& question, std::uint64_t ticket);
  /// The answer to asked(). @return whether it was one to the newest question
  bool take(std::uint64_t ticket, strategy::Decision& decision, Duration think);

  /// How what was begun stands to the scene that settled.
  enum class Verdict : std::uint8_t {
    kNone,     ///< nothing was begun, or the scene contradicts it: decide anew
    kKeep,     ///< to be taken as it is
    kCorrect,  ///< to be scored anew in this scene
  };
  Verdict settle(const Scene& scene, double min_gap);
  /// The scene settled and nothing is to be done: what was begun was for nothing.
  void not_needed();

  /// Whether the answer is there.
  bool answered() const noexcept { return draft_ && draft_->decision; }
  /// What it is about. Needs answered().
  const Scene& scene() const noexcept { return draft_->scene; }
  /// Gives the answer away, once. Needs answered().
  strategy::Decision take_decision(Duration& think);
  /// How far the discs came to rest from where they were foreseen, for people; after settle().
  const std::string& note() const noexcept { return note_; }
  const AheadCounts& counts() const noexcept { return counts_; }

 private:
  struct Draft {
    std::uint64_t ticket = 0;
    Scene scene;        // foreseen
    bool slid = false;  // from discs that still slid
    std::optional<strategy::Decision> decision;
    Duration think{};
  };

  TaskSettings settings_;
  double position_sigma_;
  RestForecast forecast_;
  std::optional<Time> since_;
  bool next_slid_ = false;  // of the question that on_scene() gave last
  std::optional<Draft> draft_;
  std::string note_;
  AheadCounts counts_;
};

}  // namespace breakshot::task
