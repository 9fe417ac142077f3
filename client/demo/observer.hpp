#pragma once

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"

#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace breakshot::client {

/// One decision with all that belongs to it.
struct DecisionRecord {
  Plan plan;
  Scene scene;                      ///< that the decision was made on; empty when it was missed
  std::optional<ColorFrame> frame;  ///< that the scene was made from
  std::optional<Outcome> outcome;   ///< once the table rests again
};

/// Watches a cell from the side, as an operator's display would: listens only.
class CellObserver {
 public:
  explicit CellObserver(int cell_domain);

  /// Waits at most `timeout` for a decision or an outcome that was not handed out yet.
  /// @return index of the record that changed; nothing when none did
  std::optional<std::size_t> next_change(Duration timeout);

  // Copies, because DDS threads go on writing.
  std::size_t decision_count() const;
  DecisionRecord decision(std::size_t index) const;
  std::optional<TaskStatus> task() const;
  std::map<std::string, Health> healths() const;
  /// Ground truth for scoring; nothing when the cell is no simulator.
  std::optional<SimTruth> truth() const;
  /// Calibration of the camera; nothing before it was heard.
  std::optional<CameraModel> camera() const;
  /// Newest scene with its frame, when both are there.
  std::optional<DecisionRecord> newest() const;
  /// Scenes per second since the first one.
  double scene_rate() const;

 private:
  void on_plan(Plan&& plan);
  void on_outcome(const Outcome& outcome);
  std::optional<ColorFrame> frame_of(const Scene& scene) const;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::size_t> changes_;
  std::vector<DecisionRecord> decisions_;
  std::deque<Scene> scenes_;
  std::deque<ColorFrame> frames_;
  std::optional<TaskStatus> task_;
  std::optional<SimTruth> truth_;
  std::optional<CameraModel> camera_;
  std::map<std::string, Health> healths_;
  std::uint64_t scene_count_ = 0;
  std::chrono::steady_clock::time_point first_scene_{};

  dds::Participant participant_;
  dds::Subscription<Scene> scene_subscription_;
  dds::Subscription<ColorFrame> frame_subscription_;
  dds::Subscription<Plan> plan_subscription_;
  dds::Subscription<Outcome> outcome_subscription_;
  dds::Subscription<TaskStatus> task_subscription_;
  dds::Subscription<Health> health_subscription_;
  dds::Subscription<SimTruth> truth_subscription_;
  dds::Subscription<CameraModel> camera_subscription_;
};

}  // namespace breakshot::client
