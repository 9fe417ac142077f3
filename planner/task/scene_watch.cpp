#include "planner/task/scene_watch.hpp"

namespace breakshot::task {

void SceneWatch::start(Time now) noexcept {
  started_ = last_exposed_ = now;
  unusable_ = Duration::zero();
  at_rest_ = 0;
  foreign_ = false;
  trouble_.clear();
}

SceneWatch::Verdict SceneWatch::on_scene(const Scene& scene) noexcept {
  if (scene.exposed <= last_exposed_) return Verdict::kIgnored;
  last_exposed_ = scene.exposed;
  foreign_ = false;
  if (scene.quality != SceneQuality::kOk) {
    at_rest_ = 0;
    trouble_ = std::string{"the camera image is "} + to_string(scene.quality) + (scene.text.empty() ? "" : ": " + scene.text);
    return Verdict::kUnusable;
  }
  if (!scene.foreign.empty()) {
    // Not forgiven by a single clear scene either: the count of scenes at rest starts anew.
    at_rest_ = 0;
    foreign_ = true;
    trouble_ = "held: " + describe(scene.foreign.front());
    if (scene.foreign.size() > 1) trouble_ += ", and " + std::to_string(scene.foreign.size() - 1) + " more";
    return Verdict::kForeign;
  }
  unusable_ = Duration::zero();
  trouble_.clear();
  if (!(scene.max_speed < settings_.settle_speed)) {
    at_rest_ = 0;
    return Verdict::kMoving;
  }
  ++at_rest_;
  return at_rest_ < settings_.settled_scenes ? Verdict::kAtRest : Verdict::kSettled;
}

}  // namespace breakshot::task
