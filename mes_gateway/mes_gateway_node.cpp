#include "mes_gateway/mes_gateway_node.hpp"

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/process/health_publisher.hpp"
#include "mes_gateway/cell_watch.hpp"
#include "mes_gateway/mes_gateway_config.hpp"
#include "mes_gateway/order_desk.hpp"
#include "mes_gateway/protocol/mes_topics.hpp"

#include <spdlog/spdlog.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <variant>

namespace breakshot::mes {

namespace {

constexpr Duration kStatusEvery = std::chrono::milliseconds{100};
constexpr Duration kHeartbeatEvery = std::chrono::milliseconds{500};
constexpr Duration kLongestNap = std::chrono::milliseconds{20};
// A process publishes its health every 100 ms; on a loaded machine it may miss a few.
constexpr Duration kSilentAfter = std::chrono::seconds{2};

std::int64_t utc_ns() { return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count(); }

/// What DDS threads leave for the gateway's one thread, so that the desk needs no locks.
class Inbox {
 public:
  using Message = std::variant<Command, TaskStatus, Health, Heartbeat>;

  void put(Message message) {
    const std::lock_guard lock{mutex_};
    messages_.push_back(std::move(message));
    arrived_.notify_one();
  }
  /// Everything that came; waits for it at most `timeout`.
  std::deque<Message> take(Duration timeout) {
    std::unique_lock lock{mutex_};
    arrived_.wait_for(lock, timeout, [this] { return !messages_.empty(); });
    return std::exchange(messages_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Message> messages_;
};

class Gateway {
 public:
  Gateway(process::Process& process, const MesGatewayConfig& config)
      : process_{process},
        config_{config},
        cell_{process.cell().dds.cell, "breakshot-mes_gateway"},
        factory_{process.cell().dds.mes, "breakshot-mes_gateway", config.interfaces},
        // Requests of an earlier life of this process must never be taken for ours: numbers go on where the clock is.
        desk_{config.orders, static_cast<std::uint64_t>(utc_ns() / 1'000'000)} {}

  void run() {
    const process::HealthPublisher health{process_, cell_, [this](Health& h) {
                                            h.state = HealthState::kReady;
                                            h.text = "serves DDS domain " + std::to_string(process_.cell().dds.mes);
                                            h.cycles = cycles_;
                                            return std::exchange(cycles_reported_, cycles_.load()) != cycles_;
                                          }};
    process_.ready("takes orders on DDS domain " + std::to_string(process_.cell().dds.mes));
    while (!process_.stop_requested()) {
      for (auto& message : inbox_.take(kLongestNap)) std::visit([this](auto& m) { handle(m); }, message);
      ++cycles_;
      const Now now = clock();
      const std::string missing = watch_.what_is_missing(now.cell);
      desk_.on_cell_ready(missing.empty(), missing);
      desk_.on_stop(watch_.what_stopped("controller", now.cell));
      desk_.tick(now);
      if (auto answer = desk_.take_answer()) acknowledge(std::move(*answer));
      if (const auto request = desk_.take_request(now)) tasks_.write(*request);
      publish_job();
      publish_status(now);
    }
  }

 private:
  Now clock() const { return {process::monotonic_now(), utc_ns()}; }

  Header header() {
    Header h;
    h.robot_id = config_.orders.robot_id;
    h.source_id = source_;
    h.session = process_.session();
    h.seq = ++seq_;
    h.stamp_utc_ns = utc_ns();
    return h;
  }

  void handle(const Command& command) {
    mes_heard_ = process::monotonic_now();
    spdlog::info("code=command verb={} command={} order={} rev={}", to_string(command.verb), to_text(command.command_id),
                 to_text(command.order_id), command.order_rev);
    if (auto ack = desk_.on_command(command, clock())) acknowledge(std::move(*ack));
  }
  void acknowledge(Ack ack) {
    ack.header = header();
    spdlog::info("code=ack command={} verdict={} reason={} text=\"{}\"", to_text(ack.command_id), to_string(ack.verdict),
                 to_string(ack.reason), ack.text);
    acks_.write(ack);
  }
  void handle(const TaskStatus& status) { desk_.on_task_status(status, clock()); }
  void handle(const Health& health) { watch_.on_health(health, process::monotonic_now()); }
  void handle(const Heartbeat& heartbeat) {
    // Our own come back to us on the same topic.
    if (heartbeat.header.source_id != source_) mes_heard_ = process::monotonic_now();
  }

  void publish_job() {
    const auto& job = desk_.job();
    if (!job || (job->order_id == told_order_ && job->order_rev == told_rev_ && job->change_no == told_change_)) return;
    told_order_ = job->order_id;
    told_rev_ = job->order_rev;
    told_change_ = job->change_no;
    JobState state = *job;
    state.header = header();
    spdlog::info("code=job order={} phase={} discs={}/{} hits={} pushes={} text=\"{}\"", to_text(state.order_id), to_string(state.phase),
                 state.discs_singulated, state.discs_seen, state.hits, state.pushes, state.text);
    jobs_.write(state);
  }

  void publish_status(const Now& now) {
    if (now.cell - heartbeat_sent_ >= kHeartbeatEvery) {
      heartbeat_sent_ = now.cell;
      heartbeats_.write({header(), desk_.accepting()});
    }
    if (now.cell - status_sent_ < kStatusEvery && desk_.state() == told_state_) return;
    status_sent_ = now.cell;
    told_state_ = desk_.state();
    RobotStatus status;
    status.header = header();
    status.boot_id = boot_;
    status.state = desk_.state();
    status.paused = desk_.paused();
    status.accepting = desk_.accepting();
    if (desk_.job() && !desk_.accepting()) status.active_order = desk_.job()->order_id;
    status.queue_free = desk_.accepting() ? 1 : 0;
    status.mes_age_ms =
        static_cast<std::uint32_t>(std::min<std::int64_t>((now.cell - mes_heard_) / std::chrono::milliseconds{1}, 1'000'000'000));
    if (const Health* controller = watch_.of("controller")) {
      status.loop_overruns = controller->overruns;
      status.loop_max_us = controller->wakeup.max_us;
      if (controller->state == HealthState::kFault) status.safety = SafetyState::kFault;
      if (controller->state == HealthState::kStopped) status.safety = SafetyState::kProtectiveStop;
    }
    status.sw_version = BREAKSHOT_VERSION;
    statuses_.write(status);
  }

  process::Process& process_;
  const MesGatewayConfig& config_;
  dds::Participant cell_;
  dds::Participant factory_;
  OrderDesk desk_;
  CellWatch watch_{{"controller", "perception", "planner"}, kSilentAfter};
  Inbox inbox_;
  Id source_ = random_id();
  Id boot_ = random_id();
  std::uint64_t seq_ = 0;
  std::atomic<std::uint64_t> cycles_{0};
  std::uint64_t cycles_reported_ = 0;
  Time mes_heard_ = process::monotonic_now();
  Time heartbeat_sent_{};
  Time status_sent_{};
  PackState told_state_ = PackState::kStopped;
  Id told_order_{};
  std::uint32_t told_rev_ = 0;
  std::uint32_t told_change_ = 0;

  dds::Writer<TaskRequest> tasks_{cell_};
  dds::Writer<Ack> acks_{factory_};
  dds::Writer<JobState> jobs_{factory_};
  dds::Writer<RobotStatus> statuses_{factory_};
  dds::Writer<Heartbeat> heartbeats_{factory_};
  // Last, so that no handler runs while the rest is taken down.
  dds::Subscription<TaskStatus> task_statuses_{cell_, [this](TaskStatus&& m) { inbox_.put(std::move(m)); }};
  dds::Subscription<Health> healths_{cell_, [this](Health&& m) { inbox_.put(std::move(m)); }};
  dds::Subscription<Command> commands_{factory_, [this](Command&& m) { inbox_.put(std::move(m)); }};
  dds::Subscription<Heartbeat> factory_heartbeats_{factory_, [this](const Heartbeat& m) { inbox_.put(m); }};
};

}  // namespace

void run_gateway(process::Process& process) {
  const MesGatewayConfig config = load_mes_gateway_config(process.config().section("mes_gateway"), process.cell());
  Gateway{process, config}.run();
}

}  // namespace breakshot::mes
