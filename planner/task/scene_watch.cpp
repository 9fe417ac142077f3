#include "planner/task/scene_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace breakshot::task {

namespace {

/// What moves in a scene, for people.
std::string motion_text(const Scene& scene) {
  if (!std::isfinite(scene.max_speed)) return "discs come and go from one picture to the next";
  char text[96];
  const auto fastest = std::max_element(scene.discs.begin(), scene.discs.end(),
                                        [](const SceneDisc& a, const SceneDisc& b) { return a.v_WD_W.norm() < b.v_WD_W.norm(); });
  if (fastest == scene.discs.end()) return "something moves";
  std::snprintf(text, sizeof text, "disc %td at (%.3f, %.3f) m moves at %.3f m/s", fastest - scene.discs.begin() + 1, fastest->p_WD.x(),
                fastest->p_WD.y(), scene.max_speed);
  return text;
}

}  // namespace

void SceneWatch::start(Time now) noexcept {
  started_ = last_exposed_ = now;
  unusable_ = Duration::zero();
  at_rest_ = 0;
  foreign_ = false;
  trouble_.clear();
  motion_.clear();
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
    motion_ = motion_text(scene);
    return Verdict::kMoving;
  }
  ++at_rest_;
  return at_rest_ < settings_.settled_scenes ? Verdict::kAtRest : Verdict::kSettled;
}

}  // namespace breakshot::task
