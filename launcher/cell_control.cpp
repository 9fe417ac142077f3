#include "launcher/cell_control.hpp"

#include "launcher/pidfd.hpp"
#include "launcher/run_directory.hpp"
#include "launcher/shm_files.hpp"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <sstream>
#include <string>

namespace breakshot::launcher {
namespace {

constexpr int kExitDown = 3;  // "program is not running", LSB init scripts

/// What the kernel says of a running process.
struct Usage {
  double cpu_s = 0.0;
  double age_s = 0.0;
  double rss_mib = 0.0;
};

Usage usage_of(pid_t pid) {
  Usage usage;
  std::ifstream file{"/proc/" + std::to_string(pid) + "/stat"};
  std::string text;
  std::getline(file, text);
  // Past the name in brackets, which may hold anything: state is field 3, utime 14, stime 15, starttime 22, rss 24 (proc(5)).
  std::istringstream fields{text.substr(std::min(text.size(), text.rfind(')') + 2))};
  std::string field;
  double ticks = 0.0;
  const auto ticks_per_s = static_cast<double>(::sysconf(_SC_CLK_TCK));
  for (int number = 3; number <= 24 && fields >> field; ++number) {
    if (number == 14 || number == 15) ticks += std::stod(field);
    if (number == 22) {
      timespec now{};
      ::clock_gettime(CLOCK_BOOTTIME, &now);
      usage.age_s = static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9 - std::stod(field) / ticks_per_s;
    }
    if (number == 24) usage.rss_mib = std::stod(field) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1024.0 * 1024.0);
  }
  usage.cpu_s = ticks / ticks_per_s;
  return usage;
}

}  // namespace

int stop_cell(const std::filesystem::path& run_directory, Duration patience) {
  const auto pid = RunDirectory::holder(run_directory);
  if (!pid) {
    std::printf("The cell is not up.\n");
    remove_stale_shm();
    return 0;
  }
  std::printf("Taking the cell down (launcher process %d) ...\n", *pid);
  std::fflush(stdout);
  const UniqueFd launcher{::pidfd_open(*pid, 0)};
  ::kill(*pid, SIGTERM);
  pollfd descriptor{launcher.get(), POLLIN, 0};
  const auto patience_ms = static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(patience).count());
  if (!launcher || ::poll(&descriptor, 1, patience_ms) == 1) {
    std::printf("The cell is down.\n");
    return 0;
  }
  ::kill(*pid, SIGKILL);  // its processes die with it, by the kernel's hand
  ::poll(&descriptor, 1, patience_ms);
  remove_stale_shm();
  std::printf("The launcher did not answer within %g s and was killed, and the cell's processes with it.\n", to_seconds(patience));
  return 1;
}

int show_cell(const std::filesystem::path& run_directory) {
  const auto holder = RunDirectory::holder(run_directory);
  const auto state = RunDirectory::read(run_directory);
  if (!holder || !state) {
    std::printf("The cell is not up. Start it with: ./breakshot up\n");
    return kExitDown;
  }
  std::printf("The cell is %s for %lld s (launcher process %d, %s).\n", state->phase.c_str(),
              static_cast<long long>(std::time(nullptr) - state->started_utc_s), *holder, state->config_file.c_str());
  std::printf("%-13s %-10s %8s %8s %10s %9s  %s\n", "process", "state", "pid", "CPU", "memory", "restarts", "status");
  bool all_ready = state->phase == "up";
  for (const ProcessInfo& info : state->processes) {
    all_ready = all_ready && info.state == ProcessState::kReady;
    const Usage usage = info.pid > 0 ? usage_of(info.pid) : Usage{};
    const std::string& text = info.state == ProcessState::kReady || info.reason.empty() ? info.status : info.reason;
    std::printf("%-13s %-10s %8d %6.1f %% %6.1f MiB %9d  %s\n", info.name.c_str(), to_string(info.state), info.pid,
                usage.age_s > 0 ? 100.0 * usage.cpu_s / usage.age_s : 0.0, usage.rss_mib, info.restarts, text.c_str());
  }
  return all_ready ? 0 : 1;
}

}  // namespace breakshot::launcher
