#include "launcher/session.hpp"

#include "common/process/exit_status.hpp"
#include "launcher/console.hpp"
#include "launcher/foreground_command.hpp"
#include "launcher/process_group.hpp"
#include "launcher/run_directory.hpp"
#include "launcher/shm_files.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <optional>
#include <system_error>
#include <thread>

namespace breakshot::launcher {
namespace {

/// How often restarts are looked for and the state file is renewed.
constexpr int kRoundMs = 200;
/// How long a command that was told to stop may take: it may have an order to cancel and a report to write.
constexpr Duration kCommandPatience = std::chrono::seconds{10};
constexpr int kSignalBase = 128;  // exit statuses of a shell

std::vector<std::string> names_of(const std::vector<ProcessSpec>& specs) {
  std::vector<std::string> names;
  for (const ProcessSpec& spec : specs) names.push_back(spec.name);
  return names;
}

UniqueFd block_and_watch_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // a closed terminal must not keep the cell from being taken down
  UniqueFd fd{::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK)};
  if (!fd) throw std::system_error{errno, std::generic_category(), "signalfd"};
  return fd;
}

class Session {
 public:
  explicit Session(const SessionOptions& options)
      : options_{options},
        directory_{options.run_directory},
        specs_{cell_processes(options.launcher, options.cell)},
        console_{stdout, options.quiet ? Console::Show::kErrors : Console::Show::kAll, names_of(specs_)},
        signal_fd_{block_and_watch_signals()},
        started_utc_s_{std::time(nullptr)} {
    for (const std::string& name : names_of(specs_)) console_.log_to(name, directory_.log_file(name));
  }

  int run() {
    clean_shared_memory("left by an earlier run");
    group_ = std::make_unique<ProcessGroup>(
        specs_, [this](const std::string& name, const std::string& line) { console_.process_line(name, line); });
    const bool up = bring_up();
    int status = up ? stay_up() : process::kExitFailure;
    if (!up && stop_signal_) status = kSignalBase + *stop_signal_;
    take_down();
    return status;
  }

 private:
  bool bring_up() {
    const auto begin = Clock::now();
    std::optional<LaunchFailure> failure;
    bool done = false;
    std::mutex mutex;
    // start() blocks; signals are heard meanwhile.
    std::thread starter{[&] {
      auto result = group_->start();
      const std::scoped_lock lock{mutex};
      if (!result) failure = result.error();
      done = true;
    }};
    while (true) {
      {
        const std::scoped_lock lock{mutex};
        if (done) break;
      }
      show_changes(begin);
      write_state("starting");
      constexpr int kStartRoundMs = 20;
      if (wait_for_signal({}, kStartRoundMs)) group_->stop();
    }
    starter.join();
    show_changes(begin);
    if (stop_signal_) return false;
    if (failure) {
      console_.say("The cell did not come up.\n" + failure->text() + "\nWhole log: " + directory_.log_file(failure->process).string());
      return false;
    }
    console_.say(fmt::format("The cell is up: {} processes READY after {:.1f} s.", specs_.size(), to_seconds(Clock::now() - begin)));
    write_state("up");
    if (options_.on_ready) options_.on_ready();
    return true;
  }

  int stay_up() {
    const auto begin = Clock::now();
    std::optional<ForegroundCommand> command;
    try {
      if (!options_.command.empty()) command.emplace(options_.command);
    } catch (const std::system_error& error) {
      console_.say(std::string{"The command could not be started: "} + error.what());
      return process::kExitUsage;
    }
    while (true) {
      std::vector<pollfd> also{{group_->failure_fd(), POLLIN, 0}};
      if (command) also.push_back({command->exit_fd(), POLLIN, 0});
      wait_for_signal(also, kRoundMs);
      show_changes(begin);
      write_state("up");
      if (const auto failure = group_->failure()) {
        console_.say("The cell lost a process.\n" + failure->text() + "\nWhole log: " + directory_.log_file(failure->process).string());
        if (command) end(*command);
        return process::kExitFailure;
      }
      if (command && also[1].revents != 0) return command->wait();
      if (stop_signal_) {
        if (command) return end(*command);
        return process::kExitOk;
      }
    }
  }

  /// Lets a command finish that has been, or is now, told to stop.
  int end(ForegroundCommand& command) {
    if (!signal_from_terminal_) command.send(SIGINT);  // a terminal has told the whole process group already
    pollfd descriptor{command.exit_fd(), POLLIN, 0};
    constexpr auto kPatienceMs = static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(kCommandPatience).count());
    if (::poll(&descriptor, 1, kPatienceMs) != 1) command.send(SIGKILL);
    return command.wait();
  }

  void take_down() {
    write_state("stopping");
    group_->stop();
    for (const ProcessInfo& info : group_->infos()) {
      if (info.state == ProcessState::kStopped && info.reason.find("was killed") != std::string::npos) {
        console_.say(info.name + " " + info.reason);
      }
    }
    if (options_.usage) say_usage();
    clean_shared_memory("left by processes that were killed");
    write_state("down");
    console_.say("The cell is down.");
  }

  void say_usage() {
    console_.say("process        CPU       of one core  peak memory  restarts");
    for (const ProcessInfo& info : group_->infos()) {
      const double ran_s = to_seconds(info.ran);
      console_.say(fmt::format("{:<13} {:>6.2f} s {:>9.1f} % {:>9.1f} MiB {:>6}", info.name, to_seconds(info.cpu_time),
                               ran_s > 0 ? 100.0 * to_seconds(info.cpu_time) / ran_s : 0.0,
                               static_cast<double>(info.peak_rss_bytes) / (1024.0 * 1024.0), info.restarts));
    }
  }

  void clean_shared_memory(const char* whose) {
    try {
      const ShmCleanup cleanup = remove_stale_shm();
      if (!cleanup.removed.empty()) console_.say(fmt::format("Removed {} shared-memory files {}.", cleanup.removed.size(), whose));
      for (const std::string& text : cleanup.failed) console_.say("Could not remove shared memory /dev/shm/" + text);
    } catch (const std::filesystem::filesystem_error& error) {
      console_.say(std::string{"Could not look for stale shared memory: "} + error.what());
    }
  }

  /// Says what has happened to the processes since the last call.
  void show_changes(Clock::time_point begin) {
    for (const ProcessInfo& info : group_->infos()) {
      auto& [state, restarts] = shown_[info.name];
      if (info.restarts > restarts) console_.say(fmt::format("{} restarted ({})", info.name, info.restarts));
      if (info.state == ProcessState::kReady && (state != ProcessState::kReady || info.restarts > restarts)) {
        console_.say(fmt::format("{:<13} READY after {:.1f} s  {}", info.name, to_seconds(Clock::now() - begin), info.status));
      }
      if (info.state == ProcessState::kRestarting && state != info.state)
        console_.say(info.name + " " + info.reason + ", will be restarted");
      state = info.state;
      restarts = info.restarts;
    }
  }

  void write_state(const char* phase) {
    directory_.write({::getpid(), phase, options_.cell.config_file.string(), started_utc_s_, group_->infos()});
  }

  /// Sleeps until a signal, one of the descriptors or the time. @return whether it was a signal; it is then in stop_signal_
  bool wait_for_signal(std::vector<pollfd>&& also, int timeout_ms) { return wait_for_signal(also, timeout_ms); }
  bool wait_for_signal(std::vector<pollfd>& also, int timeout_ms) {
    also.push_back({signal_fd_.get(), POLLIN, 0});
    ::poll(also.data(), also.size(), timeout_ms);
    also.pop_back();
    signalfd_siginfo info{};
    if (::read(signal_fd_.get(), &info, sizeof info) != static_cast<ssize_t>(sizeof info)) return false;
    stop_signal_ = static_cast<int>(info.ssi_signo);
    signal_from_terminal_ = info.ssi_code == SI_KERNEL;
    return true;
  }

  const SessionOptions& options_;
  RunDirectory directory_;
  std::vector<ProcessSpec> specs_;
  Console console_;
  UniqueFd signal_fd_;
  std::int64_t started_utc_s_;
  std::unique_ptr<ProcessGroup> group_;
  std::map<std::string, std::pair<ProcessState, int>> shown_;
  std::optional<int> stop_signal_;
  bool signal_from_terminal_ = false;
};

}  // namespace

int run_session(const SessionOptions& options) { return Session{options}.run(); }

}  // namespace breakshot::launcher
