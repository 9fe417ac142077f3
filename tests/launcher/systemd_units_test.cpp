// The systemd units say the same as the launcher's configuration, and systemd understands them.
#include "common/config/cell_config.hpp"
#include "launcher/launcher_config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>

namespace breakshot::launcher {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

using Unit = std::map<std::string, std::string>;  ///< directives; of a repeated one the values, joined by spaces

Unit read_unit(const fs::path& file) {
  Unit unit;
  std::ifstream stream{file};
  for (std::string line; std::getline(stream, line);) {
    const std::size_t equals = line.find('=');
    if (line.starts_with('#') || equals == std::string::npos) continue;
    std::string& value = unit[line.substr(0, equals)];
    if (!value.empty()) value += ' ';
    value += line.substr(equals + 1);
  }
  return unit;
}

std::set<std::string> words(const std::string& text) {
  std::istringstream stream{text};
  return {std::istream_iterator<std::string>{stream}, {}};
}

/// "200ms", "10" (seconds): all that our units use of systemd.time(7).
Duration time_span(const std::string& text) {
  const double number = std::stod(text);
  return from_seconds(text.ends_with("ms") ? number * 1e-3 : number);
}

struct Outcome {
  int status;
  std::string output;
};

Outcome run(const std::string& command) {
  std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  std::string output;
  std::array<char, 4096> buffer{};
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe)) output.append(buffer.data(), size);
  const int raw = ::pclose(pipe);
  return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, output};
}

/// The units installed under a temporary prefix, with programs that only exist.
class SystemdUnits : public ::testing::Test {
 protected:
  SystemdUnits() {
    std::string name = (fs::temp_directory_path() / "breakshot_units_XXXXXX").string();
    prefix_ = ::mkdtemp(name.data());
    const Outcome installed =
        run("cmake -DCMAKE_INSTALL_PREFIX=" + prefix_.string() + " -P " BREAKSHOT_SOURCE_DIR "/config/systemd/install.cmake");
    EXPECT_EQ(installed.status, 0) << installed.output;
    const ConfigDocument document = load_cell_document(prefix_ / "etc/cell.yaml");
    config_ = load_launcher_config(document.section("launcher"));

    fs::create_directory(prefix_ / "bin");
    for (const ProcessEntry& process : config_.processes) make_program("breakshot-" + process.name);
    make_program("breakshot-launch");
  }
  ~SystemdUnits() override { fs::remove_all(prefix_); }
  SystemdUnits(const SystemdUnits&) = delete;
  SystemdUnits& operator=(const SystemdUnits&) = delete;
  SystemdUnits(SystemdUnits&&) = delete;
  SystemdUnits& operator=(SystemdUnits&&) = delete;

  void make_program(const std::string& name) const {
    std::ofstream{prefix_ / "bin" / name} << "#!/bin/sh\n";
    fs::permissions(prefix_ / "bin" / name, fs::perms::owner_all);
  }

  fs::path unit_folder() const { return prefix_ / "lib/systemd/system"; }
  static std::string unit_name(const std::string& process) { return "breakshot-" + process + ".service"; }
  Unit unit(const std::string& process) const { return read_unit(unit_folder() / unit_name(process)); }

  fs::path prefix_;
  LauncherConfig config_;
};

TEST_F(SystemdUnits, ThereIsOneForEachProcessAndNoOther) {
  std::set<std::string> expected{"breakshot.target", "breakshot-.service.d", "breakshot-shm-clean.service"};
  for (const ProcessEntry& process : config_.processes) expected.insert(unit_name(process.name));
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator{unit_folder()}) found.insert(entry.path().filename());
  EXPECT_EQ(found, expected);
}

TEST_F(SystemdUnits, StartWhatTheLauncherStarts) {
  CellCommandLine command_line{prefix_ / "bin", prefix_ / "etc/cell.yaml"};
  LauncherConfig all = config_;
  for (ProcessEntry& process : all.processes) process.enabled = true;
  for (const ProcessSpec& spec : cell_processes(all, command_line)) {
    std::string command = spec.program.string();
    for (const std::string& argument : spec.arguments) command += ' ' + argument;
    EXPECT_EQ(unit(spec.name).at("ExecStart"), command);
  }
}

TEST_F(SystemdUnits, StartInTheLaunchersOrder) {
  std::set<std::string> wanted;
  for (const ProcessEntry& process : config_.processes) {
    std::set<std::string> expected{"breakshot-shm-clean.service"};
    for (const std::string& other : process.after) expected.insert(unit_name(other));
    std::set<std::string> after = words(unit(process.name).at("After"));
    after.erase("network.target");
    EXPECT_EQ(after, expected) << process.name;
    EXPECT_EQ(unit(process.name).at("PartOf"), "breakshot.target");
    if (process.enabled) wanted.insert(unit_name(process.name));
  }
  EXPECT_EQ(words(read_unit(unit_folder() / "breakshot.target").at("Wants")), wanted);
}

TEST_F(SystemdUnits, KeepTheLaunchersDeadlinesAndRestartPolicy) {
  std::set<std::string> codes;
  for (const int code : config_.restart.prevent_exit_codes) codes.insert(std::to_string(code));
  for (const ProcessEntry& process : config_.processes) {
    const Unit unit = this->unit(process.name);
    EXPECT_EQ(unit.at("Type"), "notify");
    EXPECT_EQ(time_span(unit.at("TimeoutStartSec")), config_.ready_timeout) << process.name;
    EXPECT_EQ(time_span(unit.at("TimeoutStopSec")), config_.stop_timeout) << process.name;
    EXPECT_EQ(time_span(unit.at("WatchdogSec")), config_.watchdog) << process.name;
    EXPECT_EQ(unit.at("Restart"), config_.restart.on_failure ? "on-failure" : "no") << process.name;
    EXPECT_EQ(time_span(unit.at("RestartSec")), config_.restart.delay) << process.name;
    EXPECT_EQ(time_span(unit.at("StartLimitIntervalSec")), config_.restart.start_limit_interval) << process.name;
    EXPECT_EQ(unit.at("StartLimitBurst"), std::to_string(config_.restart.start_limit_burst)) << process.name;
    EXPECT_EQ(words(unit.at("RestartPreventExitStatus")), codes) << process.name;
  }
}

TEST_F(SystemdUnits, TheControllerMayRunInRealTime) {
  EXPECT_EQ(unit("controller").at("LimitRTPRIO"), "90");
  EXPECT_EQ(unit("controller").at("LimitMEMLOCK"), "infinity");
}

TEST_F(SystemdUnits, SystemdAnalyzeFindsNothingToSay) {
  const Outcome verified = run("cd " + unit_folder().string() + " && systemd-analyze verify --man=no ./breakshot.target ./*.service");
  EXPECT_EQ(verified.status, 0);
  EXPECT_THAT(verified.output, IsEmpty());
}

TEST_F(SystemdUnits, AreExposedToLittle) {
  // systemd's own scale: 0 to 10, times ten; "OK" ends at 50 (systemd-analyze(1)).
  constexpr const char* kMost = "35";
  for (const auto& entry : fs::directory_iterator{unit_folder()}) {
    if (entry.path().extension() != ".service") continue;
    const Outcome security =
        run("cd " + unit_folder().string() + " && systemd-analyze security --no-pager --offline=true --threshold=" + kMost + " ./" +
            entry.path().filename().string());
    EXPECT_EQ(security.status, 0) << entry.path() << '\n' << security.output;
  }
}

}  // namespace
}  // namespace breakshot::launcher
