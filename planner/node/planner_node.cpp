#include "planner/node/planner_node.hpp"

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/process/health_publisher.hpp"
#include "common/urdf/cell_arm.hpp"
#include "controller/motion/motion_config.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "planner/arm_filter.hpp"
#include "planner/node/thinker.hpp"
#include "planner/planner_config.hpp"
#include "planner/task/task_runner.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <variant>

namespace breakshot::planner {

namespace {

constexpr Duration kStatusEvery = std::chrono::milliseconds{200};  // 5 Hz (docs/topics.md)
constexpr Duration kLongestNap = std::chrono::milliseconds{10};
/// A scene that waits for its turn behind newer ones is of no use; a second's worth bounds the queue should this thread be held up.
constexpr std::size_t kMostMessages = 256;

/// What other threads leave for the planner's one thread, so that the task needs no locks.
class Inbox {
 public:
  using Message = std::variant<TaskRequest, Scene, StrokeStatus, Decided>;

  void put(Message message) {
    const std::lock_guard lock{mutex_};
    if (messages_.size() >= kMostMessages && std::holds_alternative<Scene>(message)) {
      ++dropped_;
      return;
    }
    messages_.push_back(std::move(message));
    arrived_.notify_one();
  }
  /// Everything that came; waits for it at most `timeout`.
  std::deque<Message> take(Duration timeout) {
    std::unique_lock lock{mutex_};
    arrived_.wait_for(lock, timeout, [this] { return !messages_.empty(); });
    return std::exchange(messages_, {});
  }
  std::uint64_t dropped() const {
    const std::lock_guard lock{mutex_};
    return dropped_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Message> messages_;
  std::uint64_t dropped_ = 0;
};

/// Stroke ids of an earlier life of this process must not come again: they go on where the wall clock is. A stroke takes longer than a
/// microsecond, so a later life never catches up with an earlier one.
std::uint64_t first_stroke_id() {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count());
}

/// The arm's own planner, built when the configuration asks for it.
struct Arm {
  Arm(const ConfigDocument& document, const CellConfig& cell)
      : planner{load_cell_arm(cell), cell.arm.X_WB, motion::load_motion_settings(document.section("controller").child("motion"), cell)} {}
  motion::StrokePlanner planner;
  ArmFilter filter{planner};
};

class Planner {
 public:
  Planner(process::Process& process, const PlannerConfig& config)
      : process_{process},
        config_{config},
        participant_{process.cell().dds.cell, "breakshot-planner"},
        arm_{config.ask_arm ? std::make_unique<Arm>(process.config(), process.cell()) : nullptr},
        runner_{config.task, config.strategy, first_stroke_id(), config.settings},
        estimate_{config.estimate, config.settings},
        thinker_{strategy::make_strategy(config.strategy, config.settings), arm_ ? &arm_->filter : nullptr,
                 [this](Decided decided) { inbox_.put(std::move(decided)); }} {}

  void run() {
    const process::HealthPublisher health{process_, participant_, [this](Health& h) {
                                            h.state = knows_time() ? HealthState::kReady : HealthState::kStarting;
                                            h.text = knows_time() ? "strategy " + config_.strategy + ahead_text()
                                                                  : "waits for the first stamp of the cell clock";
                                            h.cycles = cycles_;
                                            h.dropped = inbox_.dropped();
                                            return std::exchange(cycles_reported_, cycles_.load()) != cycles_;
                                          }};
    process_.ready("strategy " + config_.strategy);
    while (!process_.stop_requested()) {
      for (auto& message : inbox_.take(kLongestNap)) {
        std::visit([this](auto& m) { handle(m); }, message);
        carry_out();
      }
      ++cycles_;
      const task::AheadCounts& ahead = runner_.ahead_counts();
      ahead_kept_ = ahead.kept;
      ahead_corrected_ = ahead.corrected;
      ahead_dropped_ = ahead.dropped;
      watch_clock();
      const Time wall = process::monotonic_now();
      runner_.on_tick(now(), wall - std::exchange(ticked_, wall));
      carry_out();
      if (wall - status_sent_ >= kStatusEvery) publish(runner_.status());
    }
    if (runner_.running()) spdlog::warn("code=task_left the process ends while a task runs; the controller ends its stroke by itself");
  }

 private:
  std::string ahead_text() const {
    return "; planned ahead: " + std::to_string(ahead_kept_) + " kept, " + std::to_string(ahead_corrected_) + " corrected, " +
           std::to_string(ahead_dropped_) + " dropped";
  }
  Time now() const noexcept { return process_.clock().now(); }
  /// False in lockstep until a first stamp came: a task that began before would take the time of the cell so far for its own.
  bool knows_time() const noexcept { return now() > Time{}; }
  /// A message that repeats an old stamp (the controller's newest stroke status, at 50 Hz) does not show that time goes on.
  void observe(Time stamp) noexcept {
    if (stamp > now()) stamp_seen_ = process::monotonic_now();
    process_.clock().observe(stamp);
  }

  void handle(const TaskRequest& request) {
    if (knows_time()) runner_.on_request(request, now());  // else it is sent again
  }
  void handle(const Scene& scene) {
    observe(scene.exposed);
    estimate_.on_scene(scene);
    if (config_.learn) runner_.on_belief(estimate_.belief(scene));
    runner_.on_scene(scene, now());
  }
  void handle(const StrokeStatus& status) {
    observe(status.stamp);
    runner_.on_stroke_status(status, now());
  }
  void handle(Decided& decided) { runner_.on_decision(decided.ticket, std::move(decided.decision), decided.think, now()); }

  /// In lockstep, time comes with messages only: when none comes, no time-out of the task can expire.
  void watch_clock() {
    if (process_.clock().mode() != process::CellTime::Mode::kLockstep || !runner_.running()) {
      running_since_ = process::monotonic_now();
      return;
    }
    const Time wall = process::monotonic_now();
    if (wall - std::max(stamp_seen_, running_since_) > config_.clock_silence) runner_.on_clock_stopped(now());
  }

  void carry_out() {
    for (auto& action : runner_.take_actions()) std::visit([this](auto& a) { act(a); }, action);
  }
  void act(const task::SendStroke& send) { strokes_.write(send.stroke); }
  void act(task::RunStrategy& question) {
    if (config_.learn) question.context.belief = estimate_.belief(question.scene);
    thinker_.ask(std::move(question));
  }
  void act(const estimate::ObservedHit& hit) {
    estimate_.on_hit(hit);
    const auto friction = estimate_.friction().belief();
    const auto restitution = estimate_.restitution().belief();
    spdlog::info("code=learnt friction={:.3f}+-{:.3f} looks={} restitution={:.3f}+-{:.3f}", friction.mean, friction.sigma,
                 estimate_.friction().looks(), restitution.mean, restitution.sigma);
  }
  void act(const Plan& plan) {
    spdlog::info("code=plan stroke={} think_ms={:.1f} {}", plan.stroke.id, 1e3 * to_seconds(plan.think), plan.why);
    plans_.write(plan);
  }
  void act(const Outcome& outcome) {
    spdlog::info("code=outcome stroke={} {} {} gap_mm={:.1f} contacts={} singulated={} lost={}", outcome.stroke_id,
                 to_string(outcome.stroke_phase), to_string(outcome.reason), 1e3 * outcome.achieved_gap, outcome.contacts_left,
                 outcome.discs_singulated, outcome.discs_lost);
    outcomes_.write(outcome);
  }
  void act(const TaskStatus& status) {
    if (status.phase != told_phase_) {
      told_phase_ = status.phase;
      const auto level = status.phase == TaskPhase::kFailed ? spdlog::level::warn
                         : is_final(status.phase)           ? spdlog::level::info
                                                            : spdlog::level::debug;
      spdlog::log(level, "code=task phase={} failure={} hits={} pushes={} {}", to_string(status.phase), to_string(status.failure),
                  status.hits, status.pushes, status.text);
    }
    publish(status);
  }
  void publish(const TaskStatus& status) {
    status_sent_ = process::monotonic_now();
    statuses_.write(status);
  }

  process::Process& process_;
  const PlannerConfig& config_;
  dds::Participant participant_;
  std::unique_ptr<Arm> arm_;
  task::TaskRunner runner_;
  estimate::TableEstimate estimate_;
  Inbox inbox_;
  std::atomic<std::uint64_t> cycles_{0};
  std::atomic<std::uint32_t> ahead_kept_{0}, ahead_corrected_{0}, ahead_dropped_{0};  // for the thread that reports health
  std::uint64_t cycles_reported_ = 0;
  Time stamp_seen_{};
  Time running_since_{};
  Time status_sent_{};
  Time ticked_ = process::monotonic_now();
  TaskPhase told_phase_ = TaskPhase::kIdle;

  dds::Writer<StrokeRequest> strokes_{participant_};
  dds::Writer<TaskStatus> statuses_{participant_};
  dds::Writer<Plan> plans_{participant_};
  dds::Writer<Outcome> outcomes_{participant_};
  Thinker thinker_;
  // Last, so that no handler runs while the rest is taken down.
  dds::Subscription<TaskRequest> tasks_{participant_, [this](TaskRequest&& m) { inbox_.put(std::move(m)); }};
  dds::Subscription<Scene> scenes_{participant_, [this](Scene&& m) { inbox_.put(std::move(m)); }};
  dds::Subscription<StrokeStatus> stroke_statuses_{participant_, [this](StrokeStatus&& m) { inbox_.put(std::move(m)); }};
};

}  // namespace

void run_planner(process::Process& process) {
  const PlannerConfig config = load_planner_config(process.config(), process.cell());
  Planner{process, config}.run();
}

}  // namespace breakshot::planner
