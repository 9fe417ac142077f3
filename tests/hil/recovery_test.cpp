#include "sim_bridge/faults.hpp"
#include "tests/hil/cell_under_test.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdlib>
#include <thread>

namespace breakshot::hil {
namespace {

using std::chrono::milliseconds;

bool is_final(const mes::JobState& job) { return job.phase == mes::JobPhase::kAborted || job.phase == mes::JobPhase::kEnded; }

/// What stops the cell, and that nothing but a recovery and a fresh order makes it go on.
class Recovery : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { cell = std::make_unique<CellUnderTest>(); }
  static void TearDownTestSuite() { cell.reset(); }
  void SetUp() override {
    ASSERT_TRUE(cell->clear_faults());
    ASSERT_TRUE(cell->set_table("A"));
  }

  /// Waits until the gateway says of the cell what is to be true; what comes first may be old.
  template <typename Condition>
  static bool says(const Condition& condition) {
    for (int i = 0; i < 300; ++i) {
      const auto status = cell->mes().next_status(std::chrono::seconds{5});
      if (status && condition(*status)) return true;
    }
    return false;
  }

  /// An order is refused, at once, in words that name the cause and what to do; and the arm rests.
  static void expect_stopped(const std::string& cause) {
    ASSERT_TRUE(says([](const mes::RobotStatus& s) { return !s.accepting && s.safety == mes::SafetyState::kProtectiveStop; }))
        << cell->logs();
    const auto before = cell->truth_at_rest();
    ASSERT_TRUE(before);
    const auto ack = cell->place_order(mes::random_id());
    ASSERT_TRUE(ack) << cell->logs();
    EXPECT_EQ(ack->verdict, mes::Verdict::kRejected);
    EXPECT_EQ(ack->reason, mes::Reason::kSafetyStop) << ack->text;
    EXPECT_NE(ack->text.find(cause), std::string::npos) << ack->text;
    EXPECT_NE(ack->text.find("./breakshot recover"), std::string::npos) << ack->text;
    EXPECT_EQ(ack->state, mes::PackState::kAborted);
    EXPECT_EQ(park().reason, RefusalReason::kStopped);
    const auto after = cell->truth_at_rest();
    ASSERT_TRUE(after);
    EXPECT_LT((after->p_WT - before->p_WT).norm(), 1e-3);
  }
  static void expect_recovers(const std::string& cause) {
    const auto ack = cell->recover();
    ASSERT_TRUE(ack) << cell->logs();
    EXPECT_NE(ack->verdict, mes::Verdict::kRejected) << ack->text;
    EXPECT_NE(ack->text.find(cause), std::string::npos) << ack->text;
    EXPECT_TRUE(says([](const mes::RobotStatus& s) { return s.accepting && s.state == mes::PackState::kStopped; }));
  }
  static StrokeStatus park() {
    StrokeRequest request;
    request.id = ++stroke_id;
    return cell->stroke(request).value_or(StrokeStatus{});
  }
  static void expect_an_order_runs() {
    ASSERT_TRUE(cell->set_table("A"));
    const auto job = cell->run_order();
    ASSERT_TRUE(job) << cell->logs();
    EXPECT_EQ(job->phase, mes::JobPhase::kEnded) << job->text;
  }

  static std::unique_ptr<CellUnderTest> cell;
  static std::uint64_t stroke_id;
};
std::unique_ptr<CellUnderTest> Recovery::cell;
std::uint64_t Recovery::stroke_id = 2'000'000;

TEST_F(Recovery, AStopInMidOrderEndsTheOrderUntilSomebodyRecovers) {
  const mes::Id order = mes::random_id();
  const auto ack = cell->place_order(order);
  ASSERT_TRUE(ack && ack->verdict == mes::Verdict::kAccepted) << cell->logs();
  std::optional<SimTruth> truth = cell->truth();
  for (int i = 0; truth && truth->v_WT_W.norm() < 0.05 && i < 100'000; ++i) truth = cell->truth();
  ASSERT_TRUE(truth);
  ASSERT_TRUE(cell->set_fault(static_cast<std::uint8_t>(sim_bridge::Fault::kDrivesDeaf)));
  const auto job = cell->follow(order, is_final);
  ASSERT_TRUE(job) << cell->logs();
  EXPECT_EQ(job->phase, mes::JobPhase::kAborted);
  EXPECT_NE(job->text.find("the drives braked by themselves"), std::string::npos) << job->text;
  ASSERT_TRUE(cell->clear_faults());
  expect_stopped("the drives braked by themselves");
  expect_recovers("the drives braked by themselves");
  expect_an_order_runs();
}

TEST_F(Recovery, ABlockInTheWayIsMetOnceAndTheClientEndsTheStop) {
  // Behind the two discs of formation A nothing lies; a push along y meets the post after some 7 cm.
  ASSERT_TRUE(cell->set_block({0.15, 0.0}, 0.03, 0.1));
  StrokeRequest push;
  push.id = ++stroke_id;
  push.kind = StrokeKind::kPush;
  push.p_WS = {0.15, -0.12};
  push.direction_W = {0.0, 1.0};
  push.speed = 0.1;
  push.length = 0.2;
  const auto stopped = cell->stroke(push);
  ASSERT_TRUE(stopped) << cell->logs();
  EXPECT_EQ(stopped->phase, StrokePhase::kStopped) << stopped->text;
  EXPECT_NE(stopped->text.find("is off by"), std::string::npos) << stopped->text;
  expect_stopped("the arm is not where it was told to be");
  ASSERT_TRUE(cell->clear_faults());

  std::string command = std::string{BREAKSHOT_BINARY_DIR} + "/bin/breakshot-client";
  for (const auto& argument : cell->arguments()) command += " '" + argument + "'";
  const int status = std::system((command + " recover").c_str());
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0) << cell->logs();
  EXPECT_EQ(park().phase, StrokePhase::kDone);
}

TEST_F(Recovery, ABridgeThatRestartsIsAProtectiveStop) {
  cell->processes().send("sim_bridge", SIGKILL);
  cell->processes().stop("sim_bridge");
  ASSERT_TRUE(cell->processes().start("sim_bridge"));
  ASSERT_TRUE(cell->truth());
  expect_stopped("the drives restarted");
  expect_recovers("the drives restarted");
  expect_an_order_runs();
}

TEST_F(Recovery, ASecondCommanderIsAControlledStopUntilItIsGone) {
  dds::Writer<JointCommand> foreign{cell->participant()};
  std::jthread commander{[&](const std::stop_token& stop) {
    JointCommand command;
    command.session = 0xbad;
    command.q = command.qd = command.qdd = JointVector::Zero(6);
    while (!stop.stop_requested()) {
      ++command.seq;
      foreign.write(command);
      std::this_thread::sleep_for(milliseconds{20});
    }
  }};
  expect_stopped("another controller");
  const auto refused = cell->recover();
  ASSERT_TRUE(refused) << cell->logs();
  EXPECT_EQ(refused->verdict, mes::Verdict::kRejected);
  EXPECT_EQ(refused->reason, mes::Reason::kSafetyStop);
  EXPECT_NE(refused->text.find("in the way: another controller"), std::string::npos) << refused->text;

  commander.request_stop();
  commander.join();
  expect_recovers("another controller");
  EXPECT_EQ(park().phase, StrokePhase::kDone);
}

}  // namespace
}  // namespace breakshot::hil
