#include "controller/node/controller_node.hpp"

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/process/health_publisher.hpp"
#include "common/process/role_lock.hpp"
#include "common/process/scheduling.hpp"
#include "common/urdf/arm_description.hpp"
#include "controller/controller_config.hpp"
#include "controller/flight/flight_recorder.hpp"
#include "controller/loop/control_loop.hpp"
#include "controller/loop/event_text.hpp"
#include "controller/loop/stroke_executor.hpp"
#include "controller/motion/stroke_planner.hpp"
#include "controller/node/command_sender.hpp"
#include "controller/node/loop_thread.hpp"
#include "controller/node/stroke_desk.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

namespace breakshot::control {

namespace {

/// Of every thread of the process: Fast DDS's receive and event threads use some ten kB, planning some hundred.
constexpr unsigned long kThreadStack = 1UL << 20U;
/// How long commands of another controller are listened for before the first own one.
constexpr Duration kListenForOthers = std::chrono::milliseconds{300};
/// How often the lack of joint states is said again.
constexpr Duration kRemind = std::chrono::seconds{5};
/// For the arm to come to rest when the process ends: a stop takes 0.3 s at rated speed.
constexpr Duration kMaxStop = std::chrono::milliseconds{1500};

/// Commands on cell/joint_command that are not ours.
struct ForeignCommands {
  std::atomic<std::uint64_t> count{0};
  std::atomic<std::uint64_t> session{0};
};

void warn_of(const std::vector<rt::MissingGuarantee>& missing) {
  if (missing.empty()) return;
  spdlog::warn("code=not_realtime ********************************************************************************");
  spdlog::warn("code=not_realtime THE CONTROL LOOP RUNS WITHOUT {} OF ITS REAL-TIME GUARANTEES", missing.size());
  for (const auto& each : missing)
    spdlog::warn("code=not_realtime missing: {}. Effect: {}. To grant it: {}.", each.what, each.effect, each.remedy);
  spdlog::warn("code=not_realtime ********************************************************************************");
}

void log_event(const LoopEvent& event) {
  using Kind = LoopEvent::Kind;
  switch (event.kind) {
    case Kind::kSafety:
      // What only holds ends by itself, and on a busy machine it comes often.
      spdlog::log(safety::kRules[static_cast<std::size_t>(event.causes.worst())].action > safety::Action::kHold ? spdlog::level::warn
                                                                                                                : spdlog::level::debug,
                  "code=safety stroke={} {}", event.stroke_id, describe(event));
      return;
    case Kind::kStopped: spdlog::warn("code=stopped stroke={} {}", event.stroke_id, describe(event)); return;
    case Kind::kNotStarted:
    case Kind::kNotRecovered: spdlog::warn("code=refused stroke={} {}", event.stroke_id, describe(event)); return;
    case Kind::kRecovered: spdlog::info("code=recovered"); return;
    case Kind::kDone: spdlog::info("code=done stroke={}", event.stroke_id); return;
    case Kind::kPhase:
    case Kind::kContact: spdlog::debug("code=stroke stroke={} {}", event.stroke_id, describe(event)); return;
  }
}

void log_record(const flight::FlightRecorder::Stored& stored, const std::string& why) {
  if (stored) {
    spdlog::info("code=flight_record file={} why=\"{}\"", stored->string(), why);
  } else {
    spdlog::warn("code=flight_record_lost {} why=\"{}\"", stored.error(), why);
  }
}

/// A unit's log folder (systemd.exec(5)) takes the place of the configured one, which its sandbox does not let it write to.
flight::RecorderSettings complete_flight(flight::RecorderSettings settings) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nobody here changes the environment
  if (const char* const logs = std::getenv("LOGS_DIRECTORY"); logs != nullptr) settings.folder = std::filesystem::path{logs} / "flight";
  return settings;
}

/// Strokes that are refused before the loop sees them are worth a record too; every status comes several times.
class RefusalNotes {
 public:
  explicit RefusalNotes(flight::FlightRecorder& recorder) : recorder_{recorder} {}

  void see(const StrokeStatus& status) {
    if (status.phase != StrokePhase::kRefused || std::exchange(last_id_, status.id) == status.id) return;
    recorder_.note(flight::Trigger::kRefusal, fmt::format("stroke {}: {}: {}", status.id, to_string(status.reason), status.text));
  }

 private:
  flight::FlightRecorder& recorder_;
  std::uint64_t last_id_ = 0;
};

double microseconds(Duration span) noexcept { return 1e6 * to_seconds(span); }

LoopTail tail_of(const rt::Histogram& histogram) {
  return {microseconds(histogram.quantile(0.5)), microseconds(histogram.quantile(0.99)), microseconds(histogram.quantile(0.999)),
          microseconds(histogram.quantile(0.9999)), microseconds(histogram.max())};
}

std::string percentiles(const rt::Histogram& histogram) {
  const LoopTail tail = tail_of(histogram);
  return fmt::format("{:.0f}/{:.0f}/{:.0f}/{:.0f}/{:.0f}", tail.p50_us, tail.p99_us, tail.p999_us, tail.p9999_us, tail.max_us);
}

void log_figures(const LoopFigures& figures) {
  spdlog::info("code=loop_figures cycles={} overruns_ours={} overruns_hosts={} wakeup_us={} compute_us={} (p50/p99/p99.9/p99.99/max)",
               figures.cycles, figures.overruns.ours, figures.overruns.hosts, percentiles(figures.wakeup), percentiles(figures.compute));
}

/// Turns what the loop knows into `cell/health`. Lives on the health thread.
class HealthReport {
 public:
  HealthReport(LoopLinks& links, const StrokeDesk& desk) : links_{links}, desk_{desk} {}

  bool operator()(Health& health) {
    const LoopStatus loop = desk_.loop();
    const LoopFigures& figures = links_.figures.latest();
    const int timer_error = links_.timer_error;
    health.state = state_of(loop, timer_error);
    health.text = text_of(loop, timer_error, figures.overruns);
    health.cycles = figures.cycles;
    health.overruns = figures.overruns.ours + figures.overruns.hosts;
    health.overruns_ours = figures.overruns.ours;
    health.overruns_hosts = figures.overruns.hosts;
    health.wakeup = tail_of(figures.wakeup);
    health.compute = tail_of(figures.compute);
    for (std::size_t flaw = 1; flaw < loop.states.size(); ++flaw) health.dropped += loop.states[flaw];
    measure_rate(health);

    const auto beats = links_.heartbeats.load(std::memory_order_relaxed);
    return std::exchange(beats_, beats) != beats;
  }

 private:
  static HealthState state_of(const LoopStatus& loop, int timer_error) {
    if (timer_error != 0 || loop.action == safety::Action::kFault) return HealthState::kFault;
    if (loop.causes.has(safety::Cause::kNoState)) return HealthState::kStarting;
    // A stop lasts until a recovery, and no order is taken before; only one that a park request brought about ends with the parking.
    safety::CauseSet asked;
    asked.add(safety::Cause::kStopRequested);
    if (loop.stopped()) return safety::lasting(loop.causes) == asked ? HealthState::kDegraded : HealthState::kStopped;
    return loop.action == safety::Action::kRun && loop.obeyed ? HealthState::kReady : HealthState::kDegraded;
  }

  static std::string text_of(const LoopStatus& loop, int timer_error, const rt::Overruns& overruns) {
    if (timer_error != 0) return fmt::format("the loop's timer failed: {}", std::system_category().message(timer_error));
    std::string text = to_string(loop.action);
    if (!loop.causes.empty()) text += ": " + describe(loop.causes);
    if (loop.causes.empty() && !loop.obeyed) text += ": the drives do not take the commands yet";
    // The host's are a fact of shared machines; ours would be a defect.
    if (overruns.ours > 0) text += fmt::format("; {} periods lost to its own computing", overruns.ours);
    return text.substr(0, 255);
  }

  void measure_rate(Health& health) {
    const auto span = health.stamp - rate_since_;
    if (span >= std::chrono::seconds{1}) {
      rate_ = static_cast<double>(health.cycles - rate_cycles_) / to_seconds(span);
      rate_since_ = health.stamp;
      rate_cycles_ = health.cycles;
    }
    health.loop_hz = rate_;
  }

  LoopLinks& links_;
  const StrokeDesk& desk_;
  std::uint64_t beats_ = 0;
  Time rate_since_{};
  std::uint64_t rate_cycles_ = 0;
  double rate_ = 0.0;
};

/// Everything but the order in which it starts and stops.
class Controller {
 public:
  explicit Controller(process::Process& process)
      : process_{process},
        config_{load_controller_config(process.config(), process.cell())},
        arm_{load_arm(process.cell().arm.urdf, process.cell().arm.base_link, process.cell().arm.tip_link)},
        planner_{arm_, process.cell().arm.X_WB, config_.motion},
        loop_config_{complete(config_.loop, arm_, process.session())},
        loop_{loop_config_, channels_, &tap_},
        executor_{planner_, channels_},
        participant_{make_participant()},
        command_writer_{*participant_},
        status_writer_{*participant_} {
    executor_.observe_events(log_event);
  }

  void run();

 private:
  static LoopConfig complete(LoopConfig loop, const ArmDescription& arm, std::uint64_t session) {
    loop.limits = joint_limits(arm, loop.stop);
    loop.session = session;
    return loop;
  }
  std::unique_ptr<dds::Participant> make_participant() const {
    std::optional<process::InheritedFifo> fifo;
    if (process_.cell().mode == CellMode::kRealTime) fifo.emplace(config_.io_priority);
    return std::make_unique<dds::Participant>(process_.cell().dds.cell, "breakshot-controller");
  }
  /// Returns when joint states come and nobody else commands; false when the process is to stop before.
  bool wait_for_drives();
  void refuse_other_commander() const;
  /// Until the process is to stop: says when it is ready, passes on what the DDS threads saw.
  void watch(StrokeDesk& desk);
  void wait_for_rest(const StrokeDesk& desk) const;

  process::Process& process_;
  ControllerConfig config_;
  ArmDescription arm_;
  motion::StrokePlanner planner_;
  LoopChannels channels_;
  LoopLinks links_;
  FlightTap tap_;
  LoopConfig loop_config_;
  ControlLoop loop_;
  StrokeExecutor executor_;
  std::atomic<std::uint64_t> states_{0};
  ForeignCommands foreign_;

  std::unique_ptr<dds::Participant> participant_;
  dds::Writer<JointCommand> command_writer_;
  dds::Writer<StrokeStatus> status_writer_;
};

void Controller::refuse_other_commander() const {
  if (foreign_.count == 0) return;
  throw process::RoleTaken(
      fmt::format("another controller (session {:016x}) sends commands on {} of domain {}: {} of them while this one listened; allowed: "
                  "none. Stop it first; one arm has one controller",
                  foreign_.session.load(), dds::Topic<JointCommand>::kName, process_.cell().dds.cell, foreign_.count.load()));
}

bool Controller::wait_for_drives() {
  Time reminded = process::monotonic_now();
  while (states_ == 0) {
    if (process_.wait(std::chrono::milliseconds{20})) return false;
    ++links_.heartbeats;
    refuse_other_commander();
    if (process::monotonic_now() - reminded < kRemind) continue;
    reminded = process::monotonic_now();
    spdlog::warn("code=no_states no joint state on {} of domain {}; is sim_bridge (or the drives' driver) running?",
                 dds::Topic<JointState>::kName, process_.cell().dds.cell);
  }
  if (process_.wait(kListenForOthers)) return false;
  refuse_other_commander();
  return true;
}

void Controller::wait_for_rest(const StrokeDesk& desk) const {
  const Time until = process::monotonic_now() + kMaxStop;
  while (process::monotonic_now() < until) {
    const LoopStatus loop = desk.loop();
    // Stopped by now, or nobody is there to move the arm.
    if (loop.action > safety::Action::kHold && (loop.at_rest || !loop.commanding)) return;
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  spdlog::warn("code=stop_timeout the arm did not come to rest within {} ms; the drives brake by themselves",
               kMaxStop / std::chrono::milliseconds{1});
}

void Controller::run() {
  const bool lockstep_mode = process_.cell().mode == CellMode::kLockstep;
  const dds::Subscription<JointCommand> others{*participant_, [this](JointCommand&& command) {
                                                 if (command.session == process_.session()) return;
                                                 foreign_.session = command.session;
                                                 ++foreign_.count;
                                               }};
  const dds::Subscription<JointState> states{*participant_, [this, lockstep_mode](JointState&& state) {
                                               process_.clock().observe(state.stamp);
                                               links_.states.write(state);
                                               ++states_;
                                               if (lockstep_mode) links_.state_came.notify();
                                             }};
  flight::FlightRecorder recorder{complete_flight(config_.flight), loop_config_, tap_, log_record};
  executor_.observe_trajectories([&recorder](std::uint64_t number, const motion::Trajectory& each) { recorder.remember(number, each); });
  RefusalNotes refusals{recorder};
  StrokeDesk desk{executor_,
                  [this, &refusals](const StrokeStatus& status) {
                    refusals.see(status);
                    status_writer_.write(status);
                  },
                  [this] { return process_.clock().now(); }};
  const dds::Subscription<StrokeRequest> requests{*participant_, [&desk](StrokeRequest&& request) { desk.submit(request); }};
  const process::HealthPublisher health{process_, *participant_, HealthReport{links_, desk}};
  if (!wait_for_drives()) return;

  // All other threads exist by now, so none of them inherits what the loop's thread gets.
  if (config_.lock_memory && !lockstep_mode) warn_of(rt::lock_memory(config_.realtime));
  const rt::WakeLatencyLimit awake{lockstep_mode ? std::nullopt : config_.realtime.wake_latency_us};
  warn_of(awake.missing());
  const CommandSender sender{links_, lockstep_mode ? 0 : config_.io_priority,
                             [this](const JointCommand& command) { command_writer_.write(command); }};
  LoopThread loop{lockstep_mode ? LoopThread::Mode::kLockstep : LoopThread::Mode::kRealTime, loop_, links_, config_.loop.period,
                  config_.realtime};
  warn_of(loop.missing_guarantees());

  watch(desk);
  desk.close();
  wait_for_rest(desk);
  log_figures(loop.stop());
}

void Controller::watch(StrokeDesk& desk) {
  bool ready = false;
  std::uint64_t foreign = 0;
  while (!process_.wait(std::chrono::milliseconds{20})) {
    if (const int error = links_.timer_error; error != 0)
      throw std::runtime_error(fmt::format("clock_nanosleep failed: {}", std::system_category().message(error)));
    if (const auto count = foreign_.count.load(); count != std::exchange(foreign, count)) {
      desk.report_foreign_commander();
    }
    if (!ready && desk.loop().ready()) {
      ready = true;
      process_.ready(fmt::format("commands the {} joints of {}, {}", arm_.joints.size(), arm_.name, to_string(process_.cell().mode)));
    }
  }
}

}  // namespace

void run_controller(process::Process& process) {
  process::limit_thread_stacks(kThreadStack);
  Controller{process}.run();
}

}  // namespace breakshot::control
