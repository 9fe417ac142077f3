#include "tests/controller/node/controller_process.hpp"
#include "tests/controller/node/fake_bridge.hpp"

#include "common/process/exit_status.hpp"
#include "controller/flight/flight_files.hpp"
#include "controller/flight/replay.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>

namespace breakshot::control::test {
namespace {

using std::chrono::seconds;

/// Long enough for a machine under any load; no test waits for it unless it fails.
constexpr Duration kPatience = seconds{30};

JointVector park_pose() {
  return (JointVector{6} << 40.0, -108.0, -93.0, -51.0, 97.0, -90.0).finished() * (std::numbers::pi / 180.0);  // cell.arm.park_deg
}

class ControllerNode : public ::testing::Test {
 protected:
  // A domain of this process's own, so that test programs may run side by side; 100 to 229 is left alone by the cell's own defaults.
  ControllerNode() : domain_{100 + static_cast<int>(getpid() % 130)}, participant_{domain_, "controller_node_test"} {
    drives_.place(park_pose());
  }
  ~ControllerNode() override { std::filesystem::remove_all(flights_); }

  std::vector<std::string> overrides(bool lockstep) const {
    return {"cell.dds.cell_domain=" + std::to_string(domain_), std::string{"cell.mode="} + (lockstep ? "lockstep" : "real_time"),
            "controller.drive_lag_ms=0", "controller.flight.folder=" + flights_.string()};
  }
  void start_bridge(bool lockstep) { bridge_ = std::make_unique<FakeBridge>(participant_, lockstep, drives_); }
  void start_controller(bool lockstep) { controller_ = std::make_unique<ControllerProcess>(overrides(lockstep)); }
  void start(bool lockstep) {
    start_bridge(lockstep);
    start_controller(lockstep);
    ASSERT_TRUE(controller_->says("code=ready", kPatience)) << controller_->log();
    // The controller finds our writer when it likes; a request before that would be lost, being volatile.
    ASSERT_TRUE(until([&] { return requests_.matched() > 0 && statuses_.matched() > 0; }));
  }

  template <typename Condition>
  bool until(const Condition& condition) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!condition()) {
      if (std::chrono::steady_clock::now() >= deadline) return false;
      StrokeStatus status;
      if (statuses_.take(status, std::chrono::milliseconds{5})) history_.push_back(status);
    }
    return true;
  }
  /// Sends a request and waits until a status of it satisfies `wanted`.
  StrokeStatus ask(const StrokeRequest& request, const std::function<bool(const StrokeStatus&)>& wanted) {
    requests_.write(request);
    return await(request.id, wanted);
  }
  StrokeStatus await(std::uint64_t id, const std::function<bool(const StrokeStatus&)>& wanted) {
    StrokeStatus found;
    const bool came = until([&] {
      for (const auto& status : history_) {
        if (status.id != id || !wanted(status)) continue;
        found = status;
        return true;
      }
      return false;
    });
    EXPECT_TRUE(came) << "stroke " << id << '\n' << controller_->log();
    return found;
  }
  static bool final(const StrokeStatus& status) { return is_final(status.phase); }

  static StrokeRequest hit(std::uint64_t id) {
    StrokeRequest request;
    request.id = id;
    request.kind = StrokeKind::kHit;
    request.p_WS = {0.05, 0.02};
    request.speed = 0.4;
    request.run_in = 0.04;
    return request;
  }
  static StrokeRequest park(std::uint64_t id) {
    StrokeRequest request;
    request.id = id;
    return request;
  }

  /// The records of a trigger, oldest first.
  std::vector<std::filesystem::path> flights(const std::string& trigger) const {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator{flights_}) {
      if (entry.path().string().ends_with("-" + trigger + ".flight")) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
  }

  int domain_;
  std::filesystem::path flights_ =
      std::string{BREAKSHOT_BINARY_DIR} + "/tests/controller_node_test." + std::to_string(getpid()) + ".flights";
  dds::Participant participant_;
  FakeDrives drives_{7};
  dds::Writer<StrokeRequest> requests_{participant_};
  dds::Reader<StrokeStatus> statuses_{participant_};
  std::vector<StrokeStatus> history_;
  std::unique_ptr<FakeBridge> bridge_;
  std::unique_ptr<ControllerProcess> controller_;
};

TEST_F(ControllerNode, RunsStrokesInLockstepAndEndsCleanly) {
  start(true);
  const auto done = ask(hit(1), final);
  EXPECT_EQ(done.phase, StrokePhase::kDone) << done.text;
  EXPECT_NEAR(done.contact_speed, 0.4, 0.004);
  StrokeRequest absurd = hit(2);
  absurd.p_WS = {5.0, 5.0};
  const auto refused = ask(absurd, final);
  EXPECT_EQ(refused.phase, StrokePhase::kRefused);
  EXPECT_FALSE(refused.text.empty());
  EXPECT_TRUE(until([&] { return std::filesystem::exists(flights_) && !flights("refusal").empty(); })) << "a refusal is recorded";
  EXPECT_EQ(ask(park(3), final).phase, StrokePhase::kDone);
  controller_->signal(SIGTERM);
  EXPECT_EQ(controller_->wait(kPatience), process::kExitOk) << controller_->log();
}

TEST_F(ControllerNode, RunsAStrokeThatIsSentAhead) {
  // In lockstep: in real time a machine that stands still for 20 ms stops the arm, as it should.
  start(true);
  ask(hit(1), [](const StrokeStatus& status) { return status.phase == StrokePhase::kTransit; });
  StrokeRequest next = hit(2);
  next.p_WS = {0.0, 0.15};
  requests_.write(next);
  EXPECT_EQ(ask(hit(3), final).reason, RefusalReason::kBusy);
  const auto accepted = await(2, [](const StrokeStatus&) { return true; });
  EXPECT_EQ(accepted.phase, StrokePhase::kAccepted) << accepted.text;
  // From rest when the machine was too busy to plan in time; joined_strokes_test sees to the rest.
  EXPECT_EQ(await(1, final).phase, StrokePhase::kDone) << controller_->log();
  EXPECT_EQ(await(2, final).phase, StrokePhase::kDone) << controller_->log();
}

TEST_F(ControllerNode, StopsOnItsPathWhenToldToEndInMidStroke) {
  start(true);
  ask(hit(1), [](const StrokeStatus& status) { return status.phase == StrokePhase::kTransit; });
  controller_->signal(SIGTERM);
  const auto stopped = await(1, final);
  EXPECT_EQ(stopped.phase, StrokePhase::kStopped) << stopped.text;
  EXPECT_EQ(controller_->wait(kPatience), process::kExitOk) << controller_->log();
  EXPECT_EQ(controller_->log().find("stop_timeout"), std::string::npos);
  EXPECT_LT(bridge_->drives().state().qd.cwiseAbs().maxCoeff(), 0.02) << "at rest when it ends";

  const auto files = flights("stop");
  ASSERT_EQ(files.size(), 1U) << controller_->log();
  const auto record = flight::load(files[0]);
  ASSERT_TRUE(record) << record.error();
  bool stopped_again = false;
  const auto replayed = flight::replay(*record, [&](const LoopEvent& event) { stopped_again |= event.kind == LoopEvent::Kind::kStopped; });
  EXPECT_FALSE(replayed.difference) << replayed.difference->what;
  EXPECT_EQ(replayed.ticks, record->ticks.size());
  EXPECT_GT(replayed.commands, 0U);
  EXPECT_TRUE(stopped_again) << "what the process did, the replay does again";
}

TEST_F(ControllerNode, TellsTheTailsOfItsTimingAndWhoseTheOverrunsAre) {
  dds::Reader<Health> healths{participant_};
  start(false);
  Health health;
  ASSERT_TRUE(until([&] {
    while (healths.take(health)) {
    }
    return health.process == "controller" && health.cycles > 300;
  })) << controller_->log();
  for (const LoopTail& tail : {health.wakeup, health.compute}) {
    EXPECT_GT(tail.p50_us, 0.0);
    EXPECT_LE(tail.p50_us, tail.p99_us);
    EXPECT_LE(tail.p99_us, tail.p999_us);
    EXPECT_LE(tail.p999_us, tail.p9999_us);
    EXPECT_LE(tail.p9999_us, tail.max_us);
  }
  EXPECT_EQ(health.overruns, health.overruns_ours + health.overruns_hosts);
  if (health.overruns > 0) {
    EXPECT_GE(health.wakeup.max_us, 1000.0) << "a wake-up that lost periods came at least that late";
  }
}

TEST_F(ControllerNode, StopsWhenTheBridgeDiesAndGoesOnOnlyWhenAskedTo) {
  start(false);
  ask(hit(1), [](const StrokeStatus& status) { return status.phase == StrokePhase::kTransit; });
  drives_ = bridge_->drives();
  bridge_.reset();
  const auto stopped = await(1, final);
  EXPECT_EQ(stopped.phase, StrokePhase::kStopped);
  EXPECT_NE(stopped.text.find("no fresh joint state"), std::string::npos) << stopped.text;
  const auto refused = ask(hit(2), final);
  EXPECT_EQ(refused.reason, RefusalReason::kStopped);
  EXPECT_NE(refused.text.find("./breakshot recover"), std::string::npos) << refused.text;

  drives_.restart();
  start_bridge(false);
  ASSERT_TRUE(controller_->says("the drives restarted", kPatience)) << controller_->log();
  // The controller commands again, and only what is. (The arm was moving when its drives died; where they brake to is theirs to say.)
  std::uint64_t acknowledged = 0;
  JointVector rest;
  ASSERT_TRUE(until([&] {
    const auto state = bridge_->drives().state();
    if (acknowledged == 0 && !state.braked && state.qd.isZero(0.0)) {
      acknowledged = state.command_seq;
      rest = state.q;
    }
    return acknowledged != 0 && state.command_seq > acknowledged + 300;
  }));
  EXPECT_LT((bridge_->drives().state().q - rest).cwiseAbs().maxCoeff(), 1e-6) << "nothing moves without a fresh request";

  EXPECT_EQ(ask(park(3), final).reason, RefusalReason::kStopped) << "nothing moves without a recovery";
  // A machine under load may stop the arm once more; an operator asks again, and so does this test.
  StrokePhase phase = StrokePhase::kRefused;
  for (std::uint64_t id = 4; id < 14 && phase != StrokePhase::kDone; id += 2) {
    StrokeRequest recover = park(id);
    recover.kind = StrokeKind::kRecover;
    ask(recover, final);
    phase = ask(park(id + 1), final).phase;
  }
  EXPECT_EQ(phase, StrokePhase::kDone) << controller_->log();
  EXPECT_LT((bridge_->drives().state().q - park_pose()).cwiseAbs().maxCoeff(), 1e-3);
}

TEST_F(ControllerNode, WaitsForABridgeThatIsLate) {
  start_controller(true);
  ASSERT_TRUE(controller_->says("code=start", kPatience)) << controller_->log();
  EXPECT_EQ(controller_->log().find("code=ready"), std::string::npos);
  start_bridge(true);
  EXPECT_TRUE(controller_->says("code=ready", kPatience)) << controller_->log();
}

TEST_F(ControllerNode, RefusesToStartBesideAnotherController) {
  start(true);
  ControllerProcess second{overrides(true)};
  EXPECT_EQ(second.wait(kPatience), process::kExitRoleTaken) << second.log();
  EXPECT_NE(second.log().find("controller"), std::string::npos);
}

TEST_F(ControllerNode, RefusesToStartWhileSomebodyElseCommandsTheDrives) {
  // A commander on another machine, or one of another make: it holds no lock of ours.
  dds::Writer<JointCommand> foreign{participant_};
  std::jthread commander{[&](const std::stop_token& stop) {
    JointCommand command;
    command.session = 0xbad;
    command.q = park_pose();
    command.qd = command.qdd = JointVector::Zero(6);
    while (!stop.stop_requested()) {
      ++command.seq;
      foreign.write(command);
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
    }
  }};
  start_bridge(false);
  start_controller(false);
  const auto status = controller_->wait(kPatience);
  EXPECT_EQ(status, process::kExitRoleTaken) << controller_->log();
  EXPECT_NE(controller_->log().find("0000000000000bad"), std::string::npos) << controller_->log();
  EXPECT_EQ(controller_->log().find("code=ready"), std::string::npos);
}

TEST_F(ControllerNode, RefusesAConfigurationThatIsWrong) {
  const auto refuses = [&](const std::string& setting, const std::string& says) {
    ControllerProcess wrong{{"cell.dds.cell_domain=" + std::to_string(domain_), setting}};
    EXPECT_EQ(wrong.wait(kPatience), process::kExitConfig) << wrong.log();
    EXPECT_NE(wrong.log().find(says), std::string::npos) << wrong.log();
  };
  refuses("controller.lead_ms=.nan", "controller.lead_ms");
  refuses("controller.safety.stop_ticks=2", "controller.safety.stop_ticks");
  refuses("controller.motion.striker_area.max=[0.1, 0.1]", "striker_area");
  refuses("cell.arm.tip_link=nose", "nose");
}

}  // namespace
}  // namespace breakshot::control::test
