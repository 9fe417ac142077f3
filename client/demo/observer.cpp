#include "client/demo/observer.hpp"

#include <algorithm>

namespace breakshot::client {

namespace {

// Frames and scenes are kept until a decision refers to them: a decision takes well under a second, 30 frames. 30 frames are 83 MB.
constexpr std::size_t kKept = 30;

template <typename T>
void keep(std::deque<T>& kept, T value) {
  kept.push_back(std::move(value));
  if (kept.size() > kKept) kept.pop_front();
}

}  // namespace

CellObserver::CellObserver(int cell_domain)
    : participant_{cell_domain, "breakshot-demo"},
      scene_subscription_{participant_,
                          [this](Scene&& m) {
                            const std::lock_guard lock{mutex_};
                            if (scene_count_++ == 0) first_scene_ = std::chrono::steady_clock::now();
                            keep(scenes_, std::move(m));
                          }},
      frame_subscription_{participant_,
                          [this](ColorFrame&& m) {
                            const std::lock_guard lock{mutex_};
                            keep(frames_, std::move(m));
                          }},
      plan_subscription_{participant_, [this](Plan&& m) { on_plan(std::move(m)); }},
      outcome_subscription_{participant_, [this](const Outcome& m) { on_outcome(m); }},
      task_subscription_{participant_,
                         [this](TaskStatus&& m) {
                           const std::lock_guard lock{mutex_};
                           task_ = std::move(m);
                         }},
      health_subscription_{participant_,
                           [this](Health&& m) {
                             const std::lock_guard lock{mutex_};
                             healths_[m.process] = m;
                           }},
      truth_subscription_{participant_,
                          [this](SimTruth&& m) {
                            const std::lock_guard lock{mutex_};
                            truth_ = std::move(m);
                          }},
      camera_subscription_{participant_, [this](CameraModel&& m) {
                             const std::lock_guard lock{mutex_};
                             camera_ = m;
                           }} {}

std::optional<std::size_t> CellObserver::next_change(Duration timeout) {
  std::unique_lock lock{mutex_};
  if (!changed_.wait_for(lock, timeout, [this] { return !changes_.empty(); })) return std::nullopt;
  const std::size_t index = changes_.front();
  changes_.pop_front();
  return index;
}

std::size_t CellObserver::decision_count() const {
  const std::lock_guard lock{mutex_};
  return decisions_.size();
}

DecisionRecord CellObserver::decision(std::size_t index) const {
  const std::lock_guard lock{mutex_};
  return decisions_.at(index);
}

std::optional<TaskStatus> CellObserver::task() const {
  const std::lock_guard lock{mutex_};
  return task_;
}

std::map<std::string, Health> CellObserver::healths() const {
  const std::lock_guard lock{mutex_};
  return healths_;
}

std::optional<SimTruth> CellObserver::truth() const {
  const std::lock_guard lock{mutex_};
  return truth_;
}

std::optional<CameraModel> CellObserver::camera() const {
  const std::lock_guard lock{mutex_};
  return camera_;
}

std::optional<DecisionRecord> CellObserver::newest() const {
  const std::lock_guard lock{mutex_};
  for (auto scene = scenes_.rbegin(); scene != scenes_.rend(); ++scene) {
    if (auto frame = frame_of(*scene)) return DecisionRecord{{}, *scene, std::move(frame), {}};
  }
  return std::nullopt;
}

double CellObserver::scene_rate() const {
  const std::lock_guard lock{mutex_};
  const double elapsed = to_seconds(std::chrono::steady_clock::now() - first_scene_);
  return scene_count_ < 2 || elapsed <= 0.0 ? 0.0 : static_cast<double>(scene_count_ - 1) / elapsed;
}

void CellObserver::on_plan(Plan&& plan) {
  const std::lock_guard lock{mutex_};
  DecisionRecord record;
  const auto scene = std::find_if(scenes_.rbegin(), scenes_.rend(), [&](const Scene& s) { return s.seq == plan.scene_seq; });
  if (scene != scenes_.rend()) {
    record.scene = *scene;
    record.frame = frame_of(*scene);
  }
  record.plan = std::move(plan);
  decisions_.push_back(std::move(record));
  changes_.push_back(decisions_.size() - 1);
  changed_.notify_all();
}

void CellObserver::on_outcome(const Outcome& outcome) {
  const std::lock_guard lock{mutex_};
  for (std::size_t i = decisions_.size(); i-- > 0;) {
    if (decisions_[i].plan.seq != outcome.plan_seq) continue;
    decisions_[i].outcome = outcome;
    changes_.push_back(i);
    changed_.notify_all();
    return;
  }
}

std::optional<ColorFrame> CellObserver::frame_of(const Scene& scene) const {
  const auto frame = std::find_if(frames_.rbegin(), frames_.rend(), [&](const ColorFrame& f) { return f.seq == scene.frame_seq; });
  if (frame == frames_.rend()) return std::nullopt;
  return *frame;
}

}  // namespace breakshot::client
