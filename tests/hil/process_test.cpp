#include "common/process/process.hpp"
#include "tests/hil/cell_under_test.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <csignal>

namespace breakshot::hil {
namespace {

using launcher::ProcessState;
using std::chrono::seconds;

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const auto& line : lines) all += line + '\n';
  return all;
}

TEST(Processes, ASecondControllerIsTurnedAway) {
  CellUnderTest cell;
  launcher::ProcessSpec second;
  second.name = "second";
  second.program = std::string{BREAKSHOT_BINARY_DIR} + "/bin/breakshot-controller";
  second.arguments = cell.arguments();
  second.ready_timeout = seconds{30};
  launcher::ProcessGroup group{{second}};
  const auto started = group.start();
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().text().find("already has a controller"), std::string::npos) << started.error().text();
  EXPECT_NE(started.error().reason.find(std::to_string(process::kExitRoleTaken)), std::string::npos) << started.error().reason;
  EXPECT_EQ(cell.processes().info("controller").state, ProcessState::kReady);
}

TEST(Processes, AKilledPlannerEndsTheOrderAndNothingResumes) {
  CellUnderTest cell;
  ASSERT_TRUE(cell.set_table("A"));
  const mes::Id order = mes::random_id();
  const auto ack = cell.place_order(order);
  ASSERT_TRUE(ack && ack->verdict == mes::Verdict::kAccepted) << cell.logs();
  ASSERT_TRUE(cell.follow(order, [](const mes::JobState& j) { return j.phase == mes::JobPhase::kRunning; }));
  cell.processes().send("planner", SIGKILL);
  const auto job =
      cell.follow(order, [](const mes::JobState& j) { return j.phase == mes::JobPhase::kAborted || j.phase == mes::JobPhase::kEnded; });
  ASSERT_TRUE(job) << cell.logs();
  EXPECT_EQ(job->phase, mes::JobPhase::kAborted);

  cell.processes().stop("planner");
  ASSERT_TRUE(cell.processes().start("planner")) << joined(cell.processes().log("planner"));
  const auto rest = cell.truth_at_rest();
  ASSERT_TRUE(rest);
  const auto strikes = rest->strikes;
  const auto next = cell.run_order();
  ASSERT_TRUE(next) << cell.logs();
  EXPECT_EQ(next->phase, mes::JobPhase::kEnded) << next->text;
  EXPECT_GE(cell.truth()->strikes, strikes);
}

TEST(Processes, ADeadBridgeIsSaidAndTheCellTakesNoOrders) {
  CellUnderTest cell{{{"planner.clock_silence_s=5"}, {}, true}};
  ASSERT_TRUE(cell.set_table("A"));
  cell.processes().send("sim_bridge", SIGKILL);
  // An order may still be taken before anybody has noticed; then it is given up, and the next one is refused.
  std::optional<mes::Ack> ack;
  for (int attempt = 0; attempt < 2; ++attempt) {
    const mes::Id order = mes::random_id();
    ack = cell.mes().send(cell.mes().command(mes::Verb::kStoreAndStart, order), seconds{20});
    ASSERT_TRUE(ack) << cell.logs();
    if (ack->verdict == mes::Verdict::kRejected) break;
    const auto job =
        cell.follow(order, [](const mes::JobState& j) { return j.phase == mes::JobPhase::kAborted || j.phase == mes::JobPhase::kEnded; });
    ASSERT_TRUE(job) << cell.logs();
    EXPECT_EQ(job->phase, mes::JobPhase::kAborted) << job->text;
  }
  // Whichever is noticed first: that the simulator is silent, or that the controller stopped for want of states.
  EXPECT_TRUE(ack->reason == mes::Reason::kNotReady || ack->reason == mes::Reason::kSafetyStop) << ack->text;
  EXPECT_FALSE(ack->text.empty());
}

TEST(Processes, ABadConfigurationIsSaidWithItsPlace) {
  for (const auto& [bad, word] : std::vector<std::pair<std::string, std::string>>{{"cell.no_such_key=1", "no_such_key"},
                                                                                  {"cell.target_gap=.nan", "target_gap"},
                                                                                  {"cell.arm.urdf=no/such.urdf", "no/such.urdf"},
                                                                                  {"cell.arm.tip_link=no_such_link", "no_such_link"}}) {
    launcher::ProcessSpec spec;
    spec.name = "controller";
    spec.program = std::string{BREAKSHOT_BINARY_DIR} + "/bin/breakshot-controller";
    spec.arguments = {
        "--config", std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml", "--set", bad, "--set", "cell.dds.cell_domain=229"};
    spec.ready_timeout = seconds{30};
    launcher::ProcessGroup group{{spec}};
    const auto started = group.start();
    ASSERT_FALSE(started) << bad;
    EXPECT_NE(started.error().reason.find(std::to_string(process::kExitConfig)), std::string::npos)
        << bad << ": " << started.error().text();
    EXPECT_NE(started.error().text().find(word), std::string::npos) << bad << ": " << started.error().text();
  }
}

}  // namespace
}  // namespace breakshot::hil
