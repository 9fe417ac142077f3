#pragma once

#include "planner/task/task_runner.hpp"
#include "tests/planner/table_sim.hpp"

#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace breakshot::test {

/// Controller, camera and table of a cell, played in simulated time around a TaskRunner. Faults are switched on by the tests.
class TaskCell {
 public:
  TaskCell(std::vector<Disc> discs, const char* strategy, const task::TaskSettings& settings = {})
      : table{std::move(discs), {}, 7}, strategy_{strategy::make_strategy(strategy, {})}, runner{settings, strategy, 100} {}

  /// A start request that fits the cell.
  static TaskRequest order(std::uint64_t seq = 1) {
    TaskRequest request;
    request.seq = seq;
    request.order_id[0] = 42;
    request.min_gap = 0.015;
    request.region = {{-0.3, -0.3}, {0.3, 0.3}};
    request.max_hits = 5;
    request.max_pushes = 20;
    request.timeout = std::chrono::seconds{120};
    return request;
  }
  void send(TaskRequest::Verb verb, std::uint64_t seq) {
    TaskRequest request = order(seq);
    request.verb = verb;
    runner.on_request(request, now);
    carry_out();
  }

  /// Plays until the condition holds or a time has passed. @return whether it held
  template <typename Condition>
  bool play(Condition done, Duration limit = std::chrono::seconds{200}) {
    const Time end = now + limit;
    while (now < end) {
      if (done()) return true;
      step();
    }
    return done();
  }
  bool play_to_end(Duration limit = std::chrono::seconds{200}) {
    return play([&] { return is_final(runner.status().phase); }, limit);
  }
  bool play_for(Duration duration) {
    return play([] { return false; }, duration);
  }
  bool play_until(TaskPhase phase) {
    return play([&] { return runner.status().phase == phase; });
  }

  // Faults.
  bool controller_dead = false;
  int deaf_to = 0;                    ///< stroke messages that get lost
  std::deque<StrokeStatus> refusals;  ///< answers to the next strokes instead of running them; id and stamp are filled in
  int stops = 0;               ///< strokes that are stopped on the way; the controller then stays stopped until it is asked to recover
  bool stopped = false;        ///< the controller refuses whatever moves
  bool unrecoverable = false;  ///< and to recover
  bool camera_dead = false;
  SceneQuality quality = SceneQuality::kOk;
  std::vector<ForeignObject> foreign;  ///< that perception reports
  double noise_speed = 0.003;          ///< that perception reports of a table at rest, m/s
  std::optional<std::size_t> hidden;   ///< a disc that perception does not see
  int hidden_scenes = 1'000'000;       ///< for how many scenes

  Time now{std::chrono::seconds{5}};
  TableSim table;
  std::vector<StrokeRequest> received;  ///< by the controller, every message
  std::vector<StrokeRequest> run;       ///< strokes that were run to their end, parks included
  std::vector<Plan> plans;
  std::vector<Outcome> outcomes;
  std::vector<TaskStatus> statuses;

 private:
  struct Moving {
    StrokeRequest stroke;
    Time begin;
    bool struck = false;
    bool stop = false;
  };

  void step() {
    now += std::chrono::milliseconds{10};
    controller();
    if ((now.time_since_epoch() / std::chrono::milliseconds{10}) % 3 == 0) camera();
    runner.on_tick(now);
    carry_out();
  }

  void controller() {
    if (!moving_ || controller_dead) return;
    const Duration since = now - moving_->begin;
    const auto at = [&](int ms) { return since >= std::chrono::milliseconds{ms}; };
    StrokeStatus status;
    status.id = moving_->stroke.id;
    status.stamp = now;
    status.contact_speed = moving_->stroke.speed;
    const bool park = moving_->stroke.kind == StrokeKind::kPark;
    status.phase = at(500) || park ? StrokePhase::kParking : at(300) ? StrokePhase::kRunIn : StrokePhase::kTransit;
    if (!park && !moving_->struck && at(500)) {
      moving_->struck = true;
      table.run(moving_->stroke);
      rests_ = now + std::chrono::milliseconds{300};
    }
    if (moving_->stop && at(200)) {
      stopped = true;
      status.phase = StrokePhase::kStopped;
      status.text = "following error";
    } else if (at(park ? 100 : 800)) {
      status.phase = StrokePhase::kDone;
    }
    if (is_final(status.phase)) {
      run.push_back(moving_->stroke);
      moving_.reset();
    }
    runner.on_stroke_status(status, now);
    carry_out();
  }

  void camera() {
    if (camera_dead) return;
    Scene scene = table.scene();
    scene.exposed = now - std::chrono::milliseconds{66};
    scene.quality = quality;
    scene.foreign = foreign;
    scene.max_speed = scene.exposed < rests_ ? 0.3 : noise_speed;
    if (hidden && hidden_scenes-- > 0) scene.discs.erase(scene.discs.begin() + static_cast<std::ptrdiff_t>(*hidden));
    runner.on_scene(scene, now);
    carry_out();
  }

  void carry_out() {
    for (task::Action& action : runner.take_actions()) {
      if (auto* send = std::get_if<task::SendStroke>(&action)) {
        take_stroke(send->stroke);
      } else if (auto* ask = std::get_if<task::RunStrategy>(&action)) {
        const auto decision = strategy_->decide(ask->scene, ask->context);
        now += std::chrono::milliseconds{5};
        runner.on_decision(ask->ticket, decision, std::chrono::milliseconds{5}, now);
        carry_out();
      } else if (auto* plan = std::get_if<Plan>(&action)) {
        plans.push_back(*plan);
      } else if (auto* outcome = std::get_if<Outcome>(&action)) {
        outcomes.push_back(*outcome);
      } else if (auto* status = std::get_if<TaskStatus>(&action)) {
        statuses.push_back(*status);
      }
    }
  }

  void take_stroke(const StrokeRequest& stroke) {
    received.push_back(stroke);
    if (controller_dead || deaf_to-- > 0) return;
    if (!refusals.empty() && stroke.kind != StrokeKind::kPark) {
      StrokeStatus status = refusals.front();
      refusals.pop_front();
      status.id = stroke.id;
      status.stamp = now;
      status.phase = StrokePhase::kRefused;
      runner.on_stroke_status(status, now);
      return;
    }
    if (stroke.kind == StrokeKind::kRecover || stopped) {
      StrokeStatus status;
      status.id = stroke.id;
      status.stamp = now;
      const bool done = stroke.kind == StrokeKind::kRecover && !unrecoverable;
      status.phase = done ? StrokePhase::kDone : StrokePhase::kRefused;
      if (!done) status.reason = stroke.kind == StrokeKind::kRecover ? RefusalReason::kNotReady : RefusalReason::kStopped;
      status.text = done ? "ended: following error" : "following error";
      if (done) stopped = false;
      runner.on_stroke_status(status, now);
      return;
    }
    if (moving_ && moving_->stroke.id == stroke.id) return;
    moving_ = Moving{stroke, now, false, stroke.kind != StrokeKind::kPark && stops-- > 0};
  }

  std::unique_ptr<strategy::Strategy> strategy_;
  std::optional<Moving> moving_;
  Time rests_{};

 public:
  task::TaskRunner runner;
};

}  // namespace breakshot::test
