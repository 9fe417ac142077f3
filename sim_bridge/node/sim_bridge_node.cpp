#include "sim_bridge/node/sim_bridge_node.hpp"

#include "common/config/camera_file.hpp"
#include "common/config/formation.hpp"
#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/process/health_publisher.hpp"
#include "common/process/scheduling.hpp"
#include "sim_bridge/node/cell_world.hpp"
#include "sim_bridge/node/control_desk.hpp"
#include "sim_bridge/node/mailbox.hpp"
#include "sim_bridge/node/pace.hpp"
#include "sim_bridge/node/physics_figures.hpp"
#include "sim_bridge/node/scene_watch.hpp"
#include "sim_bridge/node/state_sender.hpp"

#include <pthread.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <ctime>
#include <optional>
#include <system_error>
#include <thread>

namespace breakshot::sim_bridge {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kTruthPeriod = milliseconds{10};
/// Lockstep: how long a state waits for its command before it is published again; a sample may get lost.
constexpr Duration kRepeat = milliseconds{20};
/// Lockstep: how long the world waits for the scene of the frame before, wall time.
constexpr Duration kScenePatience = seconds{2};
/// Commands that may wait for the physics thread. One comes per tick; more only when that thread does not get its turn.
constexpr std::size_t kCommands = 64;
/// Where the world's clock starts in lockstep mode. Later than anything that an earlier life of this process can have stamped, for the cell's other
/// processes take time to go on only: no world runs this many times faster than the wall.
Time lockstep_start() noexcept { return Time{16 * process::monotonic_now().time_since_epoch()}; }

void sleep_until(Time wall) noexcept {
  const std::int64_t ns = to_ns(wall);
  const timespec until{.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

void ask_for_realtime(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (error == 0) return;
  spdlog::warn(
      "code=not_realtime the physics thread runs without SCHED_FIFO priority {}: {}. Effect: on a busy machine the simulated drives fall "
      "behind and catch up. "
      "To grant it: run as root, or LimitRTPRIO= in the unit",
      priority, std::system_category().message(error));
}

class SimBridge {
 public:
  explicit SimBridge(process::Process& process)
      : process_{process},
        lockstep_{process.cell().mode == CellMode::kLockstep},
        config_{load_sim_bridge_config(process.config(), process.cell())},
        formation_{load_formation(config_.formation, process.cell())},
        camera_model_{load_camera(process.cell().camera_file)},
        arm_{load_arm(process.cell().arm.urdf, process.cell().arm.base_link, process.cell().arm.tip_link)},
        world_{arm_, config_, lockstep_ ? lockstep_start() : process::monotonic_now(), process.session()},
        participant_{make_participant()},
        color_writer_{participant_},
        depth_writer_{participant_},
        info_writer_{participant_},
        camera_{lockstep_ ? CameraFeed::Mode::kLockstep : CameraFeed::Mode::kRealTime,
                camera_model_,
                config_.camera,
                arm_,
                process.cell().arm.X_WB,
                [this](const ColorFrame& color, const DepthFrame& depth) {
                  depth_writer_.write(depth);
                  color_writer_.write(color);
                }},
        sender_{participant_, lockstep_, std::max(1, config_.priority - 1)} {
    world_.place(discs_of(formation_, config_, process.cell()));
  }

  void run();

 private:
  dds::Participant make_participant() const {
    std::optional<process::InheritedFifo> fifo;
    if (!lockstep_) fifo.emplace(std::max(1, config_.priority - 1));
    return dds::Participant{process_.cell().dds.cell, "breakshot-sim_bridge"};
  }
  void run_realtime();
  void run_lockstep();
  /// What both modes do after each tick, in this order: states out, truth out, pictures taken.
  void after_tick();
  void carry_out_orders();
  bool wait_for_command(std::uint64_t state_seq);
  void let_camera_and_perception_follow();
  bool report(Health& health);

  process::Process& process_;
  const bool lockstep_;
  SimBridgeConfig config_;
  Formation formation_;
  CameraModel camera_model_;
  ArmDescription arm_;
  CellWorld world_;  // the physics thread's, once it runs

  Mailbox<JointCommand> commands_{kCommands};
  Mailbox<WorldOrder> orders_{16};
  SceneWatch scenes_;
  PhysicsFigures figures_;
  Time next_truth_{};
  std::uint64_t exposed_frame_ = 0;
  std::deque<std::pair<Time, std::uint64_t>> due_frames_;  // lockstep: on their way through the camera
  std::uint64_t last_cycles_ = 0;
  std::vector<JointCommand> taken_;
  std::vector<WorldOrder> taken_orders_;

  dds::Participant participant_;
  dds::Writer<ColorFrame> color_writer_;
  dds::Writer<DepthFrame> depth_writer_;
  dds::Writer<CameraModel> info_writer_;
  CameraFeed camera_;
  StateSender sender_;
};

void SimBridge::run() {
  info_writer_.write(camera_model_);
  const dds::Subscription<JointCommand> commands{participant_, [this](JointCommand&& command) { commands_.put(command); }};
  const dds::Subscription<Scene> scenes{participant_, [this](Scene&& scene) { scenes_.saw(scene.frame_seq); }};
  ControlDesk desk{participant_, config_, process_.cell(), orders_};

  std::exception_ptr failure;
  std::thread physics{[&] {
    pthread_setname_np(pthread_self(), "physics");
    try {
      lockstep_ ? run_lockstep() : run_realtime();
    } catch (...) {
      failure = std::current_exception();
    }
    process_.stop();
  }};
  {
    process::HealthPublisher health{process_, participant_, [this](Health& h) { return report(h); }};
    process_.ready(fmt::format("{}, {} discs ({})", to_string(process_.cell().mode), formation_.discs.size(), config_.formation));
    while (!process_.wait(milliseconds{200})) {
      if (camera_.failure()) process_.stop();
    }
    scenes_.close();
    commands_.wake();
    physics.join();
  }
  if (failure) std::rethrow_exception(failure);
  if (const auto why = camera_.failure()) throw CameraError{*why};
}

void SimBridge::run_realtime() {
  ask_for_realtime(config_.priority);
  // The world was made some time ago: starting GL takes half a second.
  world_.slip(process::monotonic_now() - world_.now());
  after_tick();
  while (!process_.stop_requested()) {
    const Time due = world_.now() + SimWorld::kTick;
    sleep_until(due);
    const Time woke = process::monotonic_now();
    const Pace now = pace(world_.now(), woke, SimWorld::kTick, kMostCatchUp);
    if (now.slip > Duration::zero()) world_.slip(now.slip);
    carry_out_orders();
    for (std::int64_t i = 0; i < now.ticks && !process_.stop_requested(); ++i) {
      commands_.take_all(taken_);
      world_.take(taken_);
      world_.tick();
      after_tick();
    }
    figures_.record(now, woke - due, process::monotonic_now() - woke, world_.world());
  }
}

void SimBridge::run_lockstep() {
  after_tick();
  while (!process_.stop_requested()) {
    carry_out_orders();
    const Time began = process::monotonic_now();
    if (world_.faults().states_broken()) {
      // Nobody can answer a state that does not come: time goes on by itself, so that the drives feel the silence.
      sleep_until(began + SimWorld::kTick);
      commands_.take_all(taken_);
      world_.take(taken_);
    } else if (!wait_for_command(world_.world().joint_state().seq)) {
      continue;
    }
    world_.tick();
    after_tick();
    let_camera_and_perception_follow();
    figures_.record({1, Duration::zero()}, Duration::zero(), process::monotonic_now() - began, world_.world());
  }
}

/// Waits for the command that acknowledges state `state_seq` and gives it to the drives. @return false when something else is to be looked at first
bool SimBridge::wait_for_command(std::uint64_t state_seq) {
  commands_.wait_all(taken_, kRepeat);
  for (const JointCommand& command : taken_) {
    if (command.state_seq != state_seq) continue;
    world_.take({&command, 1});
    return true;
  }
  if (taken_.empty()) {
    figures_.waited();
    if (const auto state = world_.published_state()) sender_.send(*state);
    sender_.send(world_.truth());
  }
  return false;
}

void SimBridge::after_tick() {
  const Time now = world_.now();
  if (const auto state = world_.published_state()) sender_.send(*state);
  if (now >= next_truth_) {
    next_truth_ = now + kTruthPeriod;
    sender_.send(world_.truth());
  }
  if (auto shot = world_.shot()) {
    if (lockstep_) due_frames_.emplace_back(shot->due, shot->seq);
    camera_.expose(std::move(*shot));
  }
}

void SimBridge::let_camera_and_perception_follow() {
  const Time now = world_.now();
  while (!due_frames_.empty() && now >= due_frames_.front().first) {
    const std::uint64_t seq = due_frames_.front().second;
    due_frames_.pop_front();
    if (exposed_frame_ != 0 && scenes_.wait_for(exposed_frame_, kScenePatience) == SceneWatch::Outcome::kTimeout) {
      spdlog::warn("code=no_scene frame={} perception did not answer within {} s; the world goes on without it until it is heard again",
                   exposed_frame_, kScenePatience / seconds{1});
    }
    camera_.pass(now);
    exposed_frame_ = seq;
  }
}

void SimBridge::carry_out_orders() {
  orders_.take_all(taken_orders_);
  for (const WorldOrder& order : taken_orders_) {
    if (const auto wrong = world_.carry_out(order)) {
      spdlog::error("code=control_refused control={} {}: {}", order.control_seq, order.what, *wrong);
      continue;
    }
    spdlog::info("code=control control={} {}", order.control_seq, order.what);
    sender_.send(world_.truth());
  }
}

bool SimBridge::report(Health& health) {
  const PhysicsFigures::Summary figures = figures_.summary(health.stamp);
  health.state = HealthState::kReady;
  health.cycles = figures.ticks;
  health.loop_hz = figures.rate;
  health.overruns = figures.slipped;
  health.wakeup.p99_us = figures.wakeup_p99_us;
  health.wakeup.max_us = figures.wakeup_max_us;
  health.compute.p99_us = figures.compute_p99_us;
  health.compute.max_us = figures.compute_max_us;
  health.dropped = camera_.dropped();
  health.text = fmt::format("{}; frames {}; commands taken {}, refused {}",
                            lockstep_ ? (figures.waiting ? "waiting for a controller" : "lockstep") : "real time", camera_.published(),
                            figures.taken, figures.refused);
  // Waiting for a controller is work too: the thread goes round.
  return std::exchange(last_cycles_, figures.rounds) != figures.rounds;
}

}  // namespace

void run_sim_bridge(process::Process& process) { SimBridge{process}.run(); }

}  // namespace breakshot::sim_bridge
