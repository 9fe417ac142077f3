// breakshot-launch as ./breakshot uses it, with the real configuration and programs that stand in for the processes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

struct Outcome {
  int status;
  std::string output;  ///< stdout and stderr
};

class LaunchProgram : public ::testing::Test {
 protected:
  LaunchProgram() {
    std::string name = (fs::temp_directory_path() / "breakshot_launch_XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    for (const char* process : {"sim_bridge", "controller", "perception", "planner", "mes_gateway", "ros_gateway"}) {
      stand_in(process, "notify 'STATUS=at work' ready wait");
    }
  }
  ~LaunchProgram() override {
    launch("down --run-directory " + run_directory());
    fs::remove_all(folder_);
  }
  LaunchProgram(const LaunchProgram&) = delete;
  LaunchProgram& operator=(const LaunchProgram&) = delete;
  LaunchProgram(LaunchProgram&&) = delete;
  LaunchProgram& operator=(LaunchProgram&&) = delete;

  /// Puts a program in the place of a process; `words` as for the dummy program.
  void stand_in(const std::string& process, const std::string& words) const {
    const fs::path path = folder_ / ("breakshot-" + process);
    std::ofstream{path} << "#!/bin/sh\necho \"arguments: $*\"\nexec " << LAUNCHER_DUMMY << ' ' << words << '\n';
    fs::permissions(path, fs::perms::owner_all);
  }

  std::string run_directory() const { return (folder_ / "run").string(); }
  std::string start_options() const {
    return " --config " BREAKSHOT_SOURCE_DIR "/config/cell.yaml --programs " + folder_.string() + " --run-directory " + run_directory() +
           " ";
  }

  static Outcome launch(const std::string& arguments) {
    std::FILE* pipe = ::popen((LAUNCH_PROGRAM " " + arguments + " 2>&1").c_str(), "r");
    std::string output;
    std::array<char, 4096> buffer{};
    while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe)) output.append(buffer.data(), size);
    const int raw = ::pclose(pipe);
    return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, output};
  }

  std::string log_of(const std::string& process) const {
    std::ifstream file{folder_ / "run" / "log" / (process + ".log")};
    return {std::istreambuf_iterator<char>{file}, {}};
  }

  fs::path folder_;
};

TEST_F(LaunchProgram, RunsACommandInARunningCellAndEndsWithIt) {
  const Outcome good = launch("run --usage" + start_options() + "-- echo the command speaks");
  EXPECT_EQ(good.status, 0) << good.output;
  EXPECT_THAT(good.output, AllOf(HasSubstr("planner     | arguments: --config"), HasSubstr("The cell is up: 5 processes READY"),
                                 HasSubstr("the command speaks"), HasSubstr("peak memory"), HasSubstr("The cell is down.")));
  EXPECT_LT(good.output.find("is up"), good.output.find("the command speaks"));
  EXPECT_LT(good.output.find("the command speaks"), good.output.find("is down"));

  EXPECT_EQ(launch("run --quiet" + start_options() + "-- sh -c 'exit 7'").status, 7);
  EXPECT_EQ(launch("run --quiet" + start_options() + "-- /nonexistent").status, 64);
}

TEST_F(LaunchProgram, GivesEveryProcessTheSameArguments) {
  launch("run --quiet --set planner.x=1 --set cell.y=2 --log-level debug" + start_options() + "-- true");
  // The overrides are refused by the strict reader before anything starts.
  EXPECT_EQ(log_of("planner"), "");
  const Outcome result = launch("run --quiet --set cell.mode=lockstep --log-level debug" + start_options() + "-- true");
  EXPECT_EQ(result.status, 0) << result.output;
  for (const char* process : {"sim_bridge", "controller", "perception", "planner", "mes_gateway"}) {
    EXPECT_EQ(log_of(process),
              "arguments: --config " BREAKSHOT_SOURCE_DIR "/config/cell.yaml --set cell.mode=lockstep --log-level debug\n");
  }
}

TEST_F(LaunchProgram, StartsWhatItIsToldTo) {
  const Outcome result = launch("run --quiet --with ros_gateway --without mes_gateway" + start_options() + "-- true");
  EXPECT_THAT(result.output, AllOf(HasSubstr("ros_gateway"), Not(HasSubstr("mes_gateway"))));
  EXPECT_EQ(launch("run --with nobody" + start_options()).status, 78);
}

TEST_F(LaunchProgram, SaysWhichProcessDidNotComeUp) {
  stand_in("planner", "say 'cell.yaml:7: planner.x: unknown key' exit 78");
  const Outcome result = launch("run --quiet" + start_options());
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.output, AllOf(HasSubstr("planner: exited with code 78"), HasSubstr("cell.yaml:7: planner.x: unknown key"),
                                   HasSubstr("log/planner.log"), HasSubstr("The cell is down.")));
}

TEST_F(LaunchProgram, ABadConfigurationStartsNothing) {
  const Outcome result = launch("run --set launcher.stop_timeout_s=-1" + start_options());
  EXPECT_EQ(result.status, 78);
  EXPECT_THAT(result.output, HasSubstr("launcher.stop_timeout_s: found -1"));
}

TEST_F(LaunchProgram, UpStatusUpDown) {
  EXPECT_EQ(launch("status --run-directory " + run_directory()).status, 3);
  const Outcome up = launch("up" + start_options());
  ASSERT_EQ(up.status, 0) << up.output;
  EXPECT_THAT(up.output, HasSubstr("The cell is up"));

  const Outcome status = launch("status --run-directory " + run_directory());
  EXPECT_EQ(status.status, 0) << status.output;
  EXPECT_THAT(status.output, AllOf(HasSubstr("The cell is up"), HasSubstr("planner       ready"), HasSubstr("at work")));

  const Outcome again = launch("up" + start_options());
  EXPECT_EQ(again.status, 73);
  EXPECT_THAT(again.output, HasSubstr("already up (launcher process"));

  EXPECT_EQ(launch("down --run-directory " + run_directory()).status, 0);
  EXPECT_EQ(launch("status --run-directory " + run_directory()).status, 3);
  EXPECT_THAT(launch("down --run-directory " + run_directory()).output, HasSubstr("not up"));
}

TEST_F(LaunchProgram, UpFailsWithTheReason) {
  stand_in("controller", "say 'no arm' exit 1");
  const Outcome result = launch("up" + start_options());
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.output, AllOf(HasSubstr("controller: exited with code 1"), HasSubstr("no arm")));
  EXPECT_EQ(launch("status --run-directory " + run_directory()).status, 3);
}

TEST_F(LaunchProgram, AKilledLauncherDoesNotKeepTheNextOneFromStarting) {
  const Outcome up = launch("up" + start_options());
  ASSERT_EQ(up.status, 0) << up.output;
  const Outcome again = launch("up" + start_options());
  const std::string mark = "launcher process ";
  const pid_t launcher = std::stoi(again.output.substr(again.output.find(mark) + mark.size()));
  ASSERT_EQ(::kill(launcher, SIGKILL), 0);
  // The lock goes with its holder; until the kernel has taken it away, the cell counts as up.
  Outcome next{};
  do {
    next = launch("up" + start_options());
  } while (next.status == 73);
  EXPECT_EQ(next.status, 0) << next.output;
}

TEST_F(LaunchProgram, AKilledLauncherTakesItsCommandWithIt) {
  const fs::path pid_file = folder_ / "pid";
  // It lets go of the pipe that launch() reads to its end, so that an outliving command is seen and not waited for.
  const std::string command = "-- sh -c 'echo $$ > " + pid_file.string() + "; exec > /dev/null 2>&1; kill -KILL $PPID; exec sleep 1000'";
  launch("run --quiet" + start_options() + command);
  pid_t pid = 0;
  ASSERT_TRUE(std::ifstream{pid_file} >> pid);
  const auto runs = [pid] {
    std::ifstream stat{"/proc/" + std::to_string(pid) + "/stat"};
    std::string number;
    std::string name;
    std::string state;
    return stat >> number >> name >> state && state != "Z" && state != "X";
  };
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds{10};
  while (runs() && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
  EXPECT_FALSE(runs()) << "the command outlived its launcher";
  if (runs()) ::kill(pid, SIGKILL);
}

TEST_F(LaunchProgram, AStopSignalTakesTheCellDown) {
  // The command is the launcher's child: its parent is whom it signals.
  const Outcome result = launch("run --quiet" + start_options() + "-- sh -c 'kill -TERM $PPID; exec sleep 100'");
  EXPECT_EQ(result.status, 128 + SIGINT) << "the command is told by SIGINT, as Ctrl-C would";
  EXPECT_THAT(result.output, HasSubstr("The cell is down."));
}

TEST_F(LaunchProgram, ALostProcessEndsTheRun) {
  stand_in("planner", "ready say 'cannot go on' exit 78");
  const Outcome result = launch("run --quiet" + start_options() + "-- sleep 100");
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.output, AllOf(HasSubstr("planner: exited with code 78"), HasSubstr("cannot go on")));
}

}  // namespace
