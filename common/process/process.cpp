#include "common/process/process.hpp"

#include "common/process/logging.hpp"
#include "common/process/notify.hpp"
#include "common/process/role_lock.hpp"
#include "common/urdf/arm_description.hpp"

#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include <csignal>
#include <iostream>
#include <optional>
#include <random>
#include <thread>
#include <vector>

namespace breakshot::process {

namespace {

std::uint64_t random_session() {
  std::random_device device;
  return (static_cast<std::uint64_t>(device()) << 32U) | device();
}

/// Waits for SIGTERM and SIGINT in a thread of its own, so that no handler ever interrupts cell code. Blocks both in the whole process.
class SignalThread {
 public:
  explicit SignalThread(std::function<void(int)> on_signal) {
    sigemptyset(&signals_);
    for (const int signal : {SIGTERM, SIGINT, kWake}) sigaddset(&signals_, signal);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    // A peer that goes away must show as an error of write(), never as a death.
    std::signal(SIGPIPE, SIG_IGN);
    thread_ = std::thread{[this, on_signal = std::move(on_signal)] {
      int signal = 0;
      while (sigwait(&signals_, &signal) == 0 && signal != kWake) on_signal(signal);
    }};
  }
  ~SignalThread() {
    pthread_kill(thread_.native_handle(), kWake);
    thread_.join();
  }
  SignalThread(const SignalThread&) = delete;
  SignalThread& operator=(const SignalThread&) = delete;
  SignalThread(SignalThread&&) = delete;
  SignalThread& operator=(SignalThread&&) = delete;

 private:
  static constexpr int kWake = SIGUSR1;
  sigset_t signals_{};
  std::thread thread_;
};

struct Options {
  std::string config;
  std::vector<std::string> overrides;
  std::string log_level = "info";
};

/// @return an exit status when the command line already says all (help, or an error that was printed), else nothing
std::optional<int> parse(const ProcessInfo& info, int argc, char** argv, Options& options) {
  CLI::App app{info.description, "breakshot-" + info.name};
  app.add_option("--config", options.config, "The cell's configuration file, usually config/cell.yaml")->required();
  app.add_option("--set", options.overrides, "Overrides one value, e.g. --set planner.strategy=random_push (repeatable)")
      ->allow_extra_args(false);
  app.add_option("--log-level", options.log_level, "trace, debug, info, warning, error or off")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  return std::nullopt;
}

}  // namespace

Process::Process(std::string name, const ConfigDocument& config, const CellConfig& cell)
    : name_{std::move(name)},
      config_{&config},
      cell_{&cell},
      session_{random_session()},
      clock_{cell.mode == CellMode::kLockstep ? CellTime::Mode::kLockstep : CellTime::Mode::kRealTime} {}

void Process::stop() noexcept {
  stop_.store(true);
  stop_.notify_all();
}

bool Process::wait(Duration duration) noexcept {
  // Short slices instead of a condition variable: a signal thread and a real-time thread may both call stop(), and neither is to take a lock.
  constexpr Duration kSlice = std::chrono::milliseconds{10};
  const auto until = std::chrono::steady_clock::now() + duration;
  while (!stop_requested()) {
    const auto left = until - std::chrono::steady_clock::now();
    if (left <= Duration::zero()) break;
    std::this_thread::sleep_for(std::min<Duration>(left, kSlice));
  }
  return stop_requested();
}

void Process::ready(const std::string& status) {
  spdlog::info("code=ready status=\"{}\"", status);
  notify_ready(status);
}

void Process::alive() noexcept {
  // Half of the shortest period that our units use would do; ten times a second costs nothing.
  constexpr std::int64_t kEvery = 100'000'000;
  const std::int64_t now = to_ns(monotonic_now());
  std::int64_t last = last_alive_ns_.load(std::memory_order_relaxed);
  if (now - last >= kEvery && last_alive_ns_.compare_exchange_strong(last, now)) notify_alive();
}

int run_process(const ProcessInfo& info, int argc, char** argv, const std::function<void(Process&)>& body) {
  Options options;
  if (const auto status = parse(info, argc, argv, options)) return *status;
  try {
    const ConfigDocument config = load_cell_document(options.config, options.overrides);
    const CellConfig cell = load_cell_config(config);
    const RoleLock role{cell.dds.cell, info.name};
    Process process{info.name, config, cell};
    // Before any other thread exists, so that all of them inherit the mask.
    const SignalThread signals{[&process](int signal) {
      spdlog::info("code=stop_requested signal={}", signal == SIGTERM ? "SIGTERM" : "SIGINT");
      notify_stopping("stopping");
      process.stop();
    }};
    start_logging(info.name, options.log_level);
    spdlog::info("code=start config={} session={:016x}", options.config, process.session());
    int status = kExitOk;
    try {
      body(process);
      spdlog::info("code=end");
    } catch (const std::exception& error) {
      spdlog::error("code=failed {}", error.what());
      notify_status(error.what());
      status = kExitFailure;
      if (dynamic_cast<const RoleTaken*>(&error) != nullptr) status = kExitRoleTaken;
      if (dynamic_cast<const ConfigError*>(&error) != nullptr || dynamic_cast<const ArmDescriptionError*>(&error) != nullptr)
        status = kExitConfig;
    }
    stop_logging();
    return status;
  } catch (const ConfigError& error) {
    std::cerr << "breakshot-" << info.name << ": " << error.what() << '\n';
    notify_status(error.what());
    return kExitConfig;
  } catch (const RoleTaken& error) {
    std::cerr << "breakshot-" << info.name << ": " << error.what() << '\n';
    notify_status(error.what());
    return kExitRoleTaken;
  } catch (const std::exception& error) {
    std::cerr << "breakshot-" << info.name << ": " << error.what() << '\n';
    return kExitFailure;
  }
}

}  // namespace breakshot::process
