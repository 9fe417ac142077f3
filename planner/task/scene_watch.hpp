#pragma once

#include "common/scene.hpp"
#include "planner/task/task_settings.hpp"

#include <string>

namespace breakshot::task {

/// Decides when what the camera shows may be decided on: a scene at rest, exposed after the arm was out of the way.
class SceneWatch {
 public:
  explicit SceneWatch(const TaskSettings& settings) : settings_{settings} {}

  enum class Verdict : std::uint8_t {
    kIgnored,   ///< exposed too early, or seen before
    kUnusable,  ///< quality is not kOk
    kForeign,   ///< something is there that is neither disc nor arm
    kMoving,    ///< a disc moves
    kAtRest,    ///< at rest, but not yet for as many scenes as it takes
    kSettled,
  };

  /// Begins to look: from now on only scenes exposed after `now` count.
  void start(Time now) noexcept;
  Verdict on_scene(const Scene& scene) noexcept;

  /// Scenes at rest in a row, since the start.
  int scenes_at_rest() const noexcept { return at_rest_; }
  /// Time in which a scene could have come (TaskRunner::on_tick).
  void wait(Duration passed) noexcept { unusable_ += passed; }
  /// Nothing usable came for longer than settings.scene_silence.
  bool silent() const noexcept { return unusable_ > settings_.scene_silence; }
  /// Usable scenes come, but for settings.settle_limit none was settled. While the newest one is not usable, that is the trouble, and silent() will say so.
  bool restless(Time now) const noexcept {
    return at_rest_ == 0 && !motion_.empty() && trouble_.empty() && now - started_ > settings_.settle_limit;
  }
  /// The newest scene showed a foreign object.
  bool foreign() const noexcept { return foreign_; }
  /// What is wrong with the newest scene, for people; empty when none came.
  const std::string& trouble() const noexcept { return trouble_; }
  /// What moved in the newest usable scene in which something did, for people.
  const std::string& motion() const noexcept { return motion_; }

 private:
  TaskSettings settings_;
  Time started_{};
  Duration unusable_{};  // since start(), or the last usable scene
  Time last_exposed_{};
  int at_rest_ = 0;
  bool foreign_ = false;
  std::string trouble_;
  std::string motion_;
};

}  // namespace breakshot::task
