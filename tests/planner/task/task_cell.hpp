#pragma once

#include "planner/task/task_runner.hpp"
#include "tests/planner/table_sim.hpp"

#include <deque>
#include <optional>
#include <utility>
#include <vector>

namespace breakshot::test {

/// Controller, camera and table of a cell, played in simulated time around a TaskRunner. Faults are switched on by the tests.
///
/// After a stroke the camera sees every disc slide straight to where the table says that it comes to rest, as Coulomb's friction has it. Collisions are
/// left out of what it sees.
class TaskCell {
 public:
  TaskCell(std::vector<Disc> discs, const char* strategy, const task::TaskSettings& settings = {})
      : table{std::move(discs), {}, 7}, strategy_{strategy::make_strategy(strategy, {})}, runner{settings, strategy, 100} {
    for (const Disc& disc : table.discs()) came_from_.push_back(disc.p_WD);
  }

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
  strategy::StrokeFilter* arm = nullptr;  ///< that the strategy may ask
  int deaf_to = 0;                        ///< stroke messages that get lost
  std::deque<StrokeStatus> refusals;      ///< answers to the next strokes instead of running them; id and stamp are filled in
  int stops = 0;               ///< strokes that are stopped on the way; the controller then stays stopped until it is asked to recover
  bool stopped = false;        ///< the controller refuses whatever moves
  bool unrecoverable = false;  ///< and to recover
  bool camera_dead = false;
  SceneQuality quality = SceneQuality::kOk;
  std::vector<ForeignObject> foreign;            ///< that perception reports
  double noise_speed = 0.003;                    ///< that perception reports of a table at rest, m/s
  Duration think{std::chrono::milliseconds{5}};  ///< that a decision takes
  std::optional<std::size_t> hidden;             ///< a disc that perception does not see
  int hidden_scenes = 1'000'000;                 ///< for how many scenes

  /// Somebody moves a disc by hand.
  void shift(std::size_t disc, const Vector2& by) {
    table.shift(disc, by);
    came_from_[disc] = table.discs()[disc].p_WD;
  }

  Time now{std::chrono::seconds{5}};
  TableSim table;
  std::vector<StrokeRequest> received;  ///< by the controller, every message
  std::vector<StrokeRequest> run;       ///< strokes that were run to their end, parks included
  std::vector<Plan> plans;
  std::vector<Outcome> outcomes;
  std::vector<TaskStatus> statuses;
  std::vector<task::RunStrategy> questions;
  int early_strokes = 0;  ///< hits and pushes asked for while the arm moved, or before a picture of the table at rest was there

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
    if (thought_ && now >= thought_->due) {
      const auto thought = *std::exchange(thought_, std::nullopt);
      runner.on_decision(thought.ticket, thought.decision, think, now);
      carry_out();
    }
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
      came_from_.clear();
      for (const Disc& disc : table.discs()) came_from_.push_back(disc.p_WD);
      struck_ = rests_ = now;
      table.run(moving_->stroke);
      for (std::size_t i = 0; i < came_from_.size(); ++i) rests_ = std::max(rests_, now + slide_time(i));
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
    scene.exposed = now - kLatency;
    scene.quality = quality;
    scene.foreign = foreign;
    scene.max_speed = noise_speed;
    for (std::size_t i = 0; i < scene.discs.size(); ++i) {
      const double left = std::max(0.0, to_seconds(struck_ + slide_time(i) - scene.exposed));
      const Vector2 way = table.discs()[i].p_WD - came_from_[i];
      const double to_go = std::min(way.norm(), 0.5 * kDeceleration * left * left);
      if (to_go > 0.0) scene.discs[i].p_WD -= to_go * way.normalized();
      scene.max_speed = std::max(scene.max_speed, to_go > 0.0 ? kDeceleration * left : 0.0);
    }
    if (hidden && hidden_scenes-- > 0) scene.discs.erase(scene.discs.begin() + static_cast<std::ptrdiff_t>(*hidden));
    runner.on_scene(scene, now);
    carry_out();
  }

  void carry_out() {
    for (task::Action& action : runner.take_actions()) {
      if (auto* send = std::get_if<task::SendStroke>(&action)) {
        take_stroke(send->stroke);
      } else if (auto* ask = std::get_if<task::RunStrategy>(&action)) {
        questions.push_back(*ask);
        ask->context.filter = arm;
        auto decision =
            ask->earlier.empty() ? strategy_->decide(ask->scene, ask->context) : strategy_->revise(ask->scene, ask->context, ask->earlier);
        thought_ = Thought{ask->ticket, std::move(decision), now + think};
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
    const bool moves_discs = stroke.kind == StrokeKind::kHit || stroke.kind == StrokeKind::kPush;
    if (moves_discs && (moving_ || now < rests_ + kLatency)) ++early_strokes;
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

  static constexpr Duration kLatency = std::chrono::milliseconds{66};
  static constexpr double kDeceleration = 0.25 * kGravity;  // m/s^2, on the table's friction

  /// How long disc i slides after the blow.
  Duration slide_time(std::size_t i) const {
    return from_seconds(std::sqrt(2.0 * (table.discs()[i].p_WD - came_from_[i]).norm() / kDeceleration));
  }

  struct Thought {
    std::uint64_t ticket;
    strategy::Decision decision;
    Time due;
  };
  std::unique_ptr<strategy::Strategy> strategy_;
  std::optional<Thought> thought_;
  std::vector<Vector2> came_from_;  // where the discs were before the last blow
  Time struck_{};
  std::optional<Moving> moving_;
  Time rests_{};

 public:
  task::TaskRunner runner;
};

}  // namespace breakshot::test
