// What happens when a process does not behave.
#include "tests/launcher/group_fixture.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>

namespace breakshot::launcher {
namespace {

using testing::dummy;
using ::testing::HasSubstr;
using testing::kPatience;
using testing::kShort;

auto state_is(ProcessState state) {
  return [state](const ProcessInfo& info) { return info.state == state; };
}
auto restarted(int times) {
  return [times](const ProcessInfo& info) { return info.restarts == times && info.state == ProcessState::kReady; };
}

TEST(Supervision, RestartsWhatIsKilledUpToItsLimit) {
  ProcessSpec spec = dummy("planner", {"ready", "wait"});
  spec.restart = testing::restart_at_once(3);
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  for (int restarts = 1; restarts <= 2; ++restarts) {
    group.send("planner", SIGKILL);
    ASSERT_TRUE(group.wait_until("planner", restarted(restarts), kPatience));
    EXPECT_FALSE(group.failure());
  }
  group.send("planner", SIGKILL);
  ASSERT_TRUE(group.wait_until("planner", state_is(ProcessState::kFailed), kPatience));
  pollfd descriptor{group.failure_fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&descriptor, 1, 20'000), 1);
  EXPECT_EQ(group.failure()->reason, "killed by SIGKILL; given up after 3 starts within 3600 s");

  ASSERT_TRUE(group.start()) << "whoever asks for it gets a new count";
  EXPECT_FALSE(group.failure());
  EXPECT_EQ(group.info("planner").restarts, 0);
}

TEST(Supervision, DoesNotRestartWithoutAPolicy) {
  ProcessGroup group{{dummy("planner", {"ready", "wait"})}};
  ASSERT_TRUE(group.start());
  group.send("planner", SIGKILL);
  ASSERT_TRUE(group.wait_until("planner", state_is(ProcessState::kFailed), kPatience));
  EXPECT_EQ(group.info("planner").reason, "killed by SIGKILL");
}

TEST(Supervision, DoesNotRestartWhatWouldFailAgain) {
  ProcessSpec spec = dummy("planner", {"ready", "await-signal", "exit", "78"});
  spec.restart = testing::restart_at_once(5);
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  group.send("planner", SIGUSR1);
  ASSERT_TRUE(group.wait_until("planner", state_is(ProcessState::kFailed), kPatience));
  EXPECT_EQ(group.info("planner").restarts, 0);
}

TEST(Supervision, AProcessThatGoesByItselfIsAFailureOfTheGroup) {
  ProcessSpec spec = dummy("planner", {"ready", "await-signal", "exit", "0"});
  spec.restart = testing::restart_at_once(5);
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  group.send("planner", SIGUSR1);
  ASSERT_TRUE(group.wait_until("planner", state_is(ProcessState::kExited), kPatience));
  EXPECT_EQ(group.failure()->reason, "exited with code 0");
}

TEST(Supervision, TheWatchdogEndsASilentProcess) {
  ProcessSpec spec = dummy("planner", {"ready", "hang"});
  spec.watchdog = kShort;
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  ASSERT_TRUE(group.wait_until("planner", state_is(ProcessState::kFailed), kPatience));
  EXPECT_EQ(group.info("planner").reason, "watchdog: no sign of life for 0.1 s");
}

TEST(Supervision, TheWatchdogAlsoEndsAStoppedProcessThatDoesNotHear) {
  ProcessSpec spec = dummy("planner", {"ready", "notify", "WATCHDOG=1", "hang"});
  spec.watchdog = kShort;
  spec.stop_timeout = kShort;
  spec.restart = testing::restart_at_once(1);
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  group.send("planner", SIGSTOP);
  ASSERT_TRUE(group.wait_until("planner", state_is(ProcessState::kFailed), kPatience));
  EXPECT_THAT(group.info("planner").reason, HasSubstr("watchdog"));
}

TEST(Supervision, KillsWhatIgnoresSigterm) {
  ProcessSpec spec = dummy("planner", {"ignore-term", "ready", "hang"});
  spec.stop_timeout = kShort;
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  const pid_t pid = group.info("planner").pid;
  group.stop();
  EXPECT_TRUE(testing::goes(pid));
  EXPECT_EQ(group.info("planner").state, ProcessState::kStopped);
  EXPECT_EQ(group.info("planner").reason, "did not stop within 0.1 s and was killed");
}

TEST(Supervision, StopsWhatWaitsForItsRestart) {
  ProcessSpec spec = dummy("planner", {"ready", "wait"});
  spec.restart = testing::restart_at_once(5);
  spec.restart.delay = std::chrono::hours{1};
  ProcessGroup group{{spec}};
  ASSERT_TRUE(group.start());
  group.send("planner", SIGKILL);
  ASSERT_TRUE(group.wait_until("planner", state_is(ProcessState::kRestarting), kPatience));
  group.stop();
  EXPECT_EQ(group.info("planner").state, ProcessState::kStopped);
}

TEST(Supervision, TakesGrandchildrenAlong) {
  ProcessGroup group{{dummy("planner", {"fork", "ready", "wait"})}};
  ASSERT_TRUE(group.start());
  ASSERT_TRUE(group.wait_until(
      "planner", [&](const ProcessInfo&) { return true; }, kPatience));
  group.stop();
  const auto log = group.log("planner");
  ASSERT_EQ(log.size(), 1U);
  EXPECT_TRUE(testing::goes(std::stoi(log.front().substr(6))));
}

TEST(Supervision, ReportsWhatAProcessUsed) {
  ProcessGroup group{{dummy("planner", {"ready", "wait"})}};
  ASSERT_TRUE(group.start());
  group.stop();
  EXPECT_GT(group.info("planner").peak_rss_bytes, 0U);
  EXPECT_GT(group.info("planner").ran, Duration::zero());
}

TEST(Supervision, AKilledLauncherLeavesNobodyBehind) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  const pid_t holder = ::fork();
  if (holder == 0) {
    ::dup2(ends[1], STDOUT_FILENO);
    ::execl(LAUNCHER_HOLDER, LAUNCHER_HOLDER, LAUNCHER_DUMMY, static_cast<char*>(nullptr));
    ::_exit(127);
  }
  ::close(ends[1]);
  std::FILE* output = ::fdopen(ends[0], "r");
  int plain = 0;
  int stubborn = 0;
  ASSERT_EQ(std::fscanf(output, "%d %d", &plain, &stubborn), 2);
  EXPECT_EQ(::kill(plain, 0), 0);
  EXPECT_EQ(::kill(stubborn, 0), 0);

  ::kill(holder, SIGKILL);
  ASSERT_EQ(::waitpid(holder, nullptr, 0), holder);
  EXPECT_TRUE(testing::goes(plain));
  EXPECT_TRUE(testing::goes(stubborn));
  std::fclose(output);
}

}  // namespace
}  // namespace breakshot::launcher
