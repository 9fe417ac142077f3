#include "tests/launcher/group_fixture.hpp"

#include <gmock/gmock.h>

#include <mutex>
#include <stdexcept>

namespace breakshot::launcher {
namespace {

using testing::dummy;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(ProcessGroup, StartsInOrderAndStopsInReverse) {
  std::mutex mutex;
  std::vector<std::string> lines;
  ProcessGroup group{{dummy("planner", {"say", "starts", "ready", "wait", "say", "stops"}, {"controller"}),
                      dummy("controller", {"say", "starts", "ready", "wait", "say", "stops"}, {"bridge"}),
                      dummy("bridge", {"say", "starts", "ready", "wait", "say", "stops"})},
                     [&](const std::string& name, const std::string& line) {
                       const std::scoped_lock lock{mutex};
                       lines.push_back(name + " " + line);
                     }};
  ASSERT_TRUE(group.start());
  for (const ProcessInfo& info : group.infos()) {
    EXPECT_EQ(info.state, ProcessState::kReady);
    EXPECT_EQ(info.status, "at work");
    EXPECT_GT(info.pid, 0);
  }
  group.stop();
  EXPECT_THAT(lines,
              ElementsAre("bridge starts", "controller starts", "planner starts", "planner stops", "controller stops", "bridge stops"));
  EXPECT_EQ(group.info("planner").state, ProcessState::kStopped);
  EXPECT_FALSE(group.failure());
}

TEST(ProcessGroup, WaitsForASlowStarter) {
  ProcessGroup group{
      {dummy("slow", {"notify", "STATUS=loading", "await-signal", "ready", "wait"}), dummy("next", {"ready", "wait"}, {"slow"})}};
  std::thread waker{[&] {
    EXPECT_TRUE(group.wait_until(
        "slow", [](const ProcessInfo& info) { return info.status == "loading"; }, testing::kPatience));
    EXPECT_EQ(group.info("next").state, ProcessState::kStopped);
    group.send("slow", SIGUSR1);
  }};
  EXPECT_TRUE(group.start());
  waker.join();
}

TEST(ProcessGroup, CanBeStartedAgain) {
  ProcessGroup group{{dummy("one", {"ready", "wait"}), dummy("two", {"ready", "wait"}, {"one"})}};
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(group.start());
    const pid_t pid = group.info("one").pid;
    ASSERT_TRUE(group.start()) << "already up";
    EXPECT_EQ(group.info("one").pid, pid);
    group.stop();
    group.stop();
  }
}

TEST(ProcessGroup, StartsAndStopsOneAlone) {
  ProcessGroup group{{dummy("bridge", {"ready", "wait"}), dummy("controller", {"ready", "wait"}, {"bridge"})}};
  ASSERT_TRUE(group.start("controller"));
  EXPECT_EQ(group.info("bridge").state, ProcessState::kStopped);
  ASSERT_TRUE(group.start());
  group.stop("controller");
  EXPECT_EQ(group.info("controller").state, ProcessState::kStopped);
  EXPECT_EQ(group.info("bridge").state, ProcessState::kReady);
}

TEST(ProcessGroup, KeepsALogThatNamesTheLastLine) {
  ProcessGroup group{{dummy("one", {"say", "first", "mumble", "no end", "ready", "wait", "say", " of it"})}};
  ASSERT_TRUE(group.start());
  group.stop();
  EXPECT_THAT(group.log("one"), ElementsAre("first", "no end of it"));
}

TEST(ProcessGroup, GivesTheEnvironmentOfTheSpecAndNotItsOwnSystemdWords) {
  ::setenv("LISTEN_FDS", "3", 1);
  ProcessSpec spec = dummy("one", {"env", "LISTEN_FDS", "env", "WATCHDOG_USEC", "env", "CELL", "ready", "wait"});
  spec.environment = {{"CELL", "7"}};
  spec.watchdog = std::chrono::seconds{60};
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  group.stop();
  ::unsetenv("LISTEN_FDS");
  EXPECT_THAT(group.log("one"), ElementsAre("LISTEN_FDS is not set", "WATCHDOG_USEC 60000000", "CELL 7"));
}

TEST(ProcessGroup, RefusesAnOrderThatCannotBe) {
  EXPECT_THROW(ProcessGroup({dummy("one", {}), dummy("one", {})}), std::invalid_argument);
  EXPECT_THROW(ProcessGroup({dummy("one", {}, {"none"})}), std::invalid_argument);
  EXPECT_THROW(ProcessGroup({dummy("one", {}, {"two"}), dummy("two", {}, {"one"})}), std::invalid_argument);
}

TEST(ProcessGroup, RefusesAnUnknownName) {
  ProcessGroup group{{dummy("one", {})}};
  EXPECT_THROW(group.info("two"), std::invalid_argument);
  EXPECT_THROW((void)group.start("two"), std::invalid_argument);
}

TEST(ProcessGroup, SaysWhyOneDoesNotComeUpAndTakesTheOthersDown) {
  struct Case {
    std::vector<std::string> words;
    std::string reason;
  };
  const std::vector<Case> cases{
      {{"say", "cell.yaml:3: planner.x: unknown key", "exit", "78"}, "exited with code 78"},
      {{"say", "cell.yaml:3: planner.x: unknown key", "crash"}, "killed by SIGSEGV"},
      {{"say", "cell.yaml:3: planner.x: unknown key", "exit", "0"}, "exited with code 0"},
      {{"say", "cell.yaml:3: planner.x: unknown key", "notify", "STATUS=waiting for the bridge", "hang"}, "not READY within 0.1 s"},
  };
  for (const Case& test : cases) {
    ProcessSpec bad = dummy("planner", test.words, {"bridge"});
    bad.restart = testing::restart_at_once(5);
    if (test.words.back() == "hang") bad.ready_timeout = testing::kShort;
    ProcessGroup group{{dummy("bridge", {"ready", "wait"}), bad, dummy("gateway", {"ready", "wait"}, {"planner"})}};
    const auto result = group.start();
    ASSERT_FALSE(result) << test.reason;
    EXPECT_EQ(result.error().process, "planner");
    EXPECT_EQ(result.error().reason, test.reason);
    EXPECT_EQ(result.error().status, test.words.back() == "hang" ? "waiting for the bridge" : "");
    if (test.words.back() != "hang") {
      EXPECT_THAT(result.error().last_lines, ElementsAre("cell.yaml:3: planner.x: unknown key"));
    }
    EXPECT_THAT(result.error().text(), StartsWith("planner: " + test.reason));
    EXPECT_EQ(group.info("bridge").state, ProcessState::kStopped);
    EXPECT_EQ(group.info("gateway").started, Clock::time_point{}) << "never started";
  }
}

TEST(ProcessGroup, SaysWhatProgramIsMissing) {
  ProcessSpec spec = dummy("planner", {});
  spec.program = "/nonexistent/breakshot-planner";
  ProcessGroup group{{spec}};
  const auto result = group.start();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().reason, "could not be started: /nonexistent/breakshot-planner: No such file or directory");
}

TEST(ProcessGroup, AStopEndsAStartThatWaits) {
  ProcessGroup group{{dummy("slow", {"hang"})}};
  std::thread stopper{[&] {
    group.wait_until(
        "slow", [](const ProcessInfo& info) { return info.state == ProcessState::kStarting; }, testing::kPatience);
    group.stop();
  }};
  const auto result = group.start();
  stopper.join();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().reason, "stopped before it was READY");
}

}  // namespace
}  // namespace breakshot::launcher
