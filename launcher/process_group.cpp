#include "launcher/process_group.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace breakshot::launcher {
namespace {

constexpr std::size_t kLinesInFailure = 15;

UniqueFd make_eventfd() {
  UniqueFd fd{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  if (!fd) throw std::system_error{errno, std::generic_category(), "eventfd"};
  return fd;
}

/// Orders the specs so that each comes behind those in its `after`, else as they were given.
std::vector<ProcessSpec> in_start_order(std::vector<ProcessSpec> specs) {
  std::set<std::string> names;
  for (const ProcessSpec& spec : specs) {
    if (!names.insert(spec.name).second) throw std::invalid_argument{"two processes are called " + spec.name};
  }
  for (const ProcessSpec& spec : specs) {
    for (const std::string& other : spec.after) {
      if (!names.contains(other))
        throw std::invalid_argument{spec.name + " is to start after " + other + ", which is no process of the group"};
    }
  }
  std::vector<ProcessSpec> ordered;
  std::set<std::string> placed;
  while (!specs.empty()) {
    const auto next = std::ranges::find_if(specs, [&](const ProcessSpec& spec) {
      return std::ranges::all_of(spec.after, [&](const std::string& other) { return placed.contains(other); });
    });
    if (next == specs.end()) throw std::invalid_argument{"the start order of " + specs.front().name + " goes in a circle"};
    placed.insert(next->name);
    ordered.push_back(std::move(*next));
    specs.erase(next);
  }
  return ordered;
}

}  // namespace

std::string LaunchFailure::text() const {
  std::string result = process + ": " + reason;
  if (!status.empty()) result += "\n  its last status: " + status;
  if (last_lines.empty()) return result + "\n  it printed nothing";
  result += "\n  its last lines:";
  for (const std::string& line : last_lines) result += "\n    " + line;
  return result;
}

ProcessGroup::ProcessGroup(std::vector<ProcessSpec> specs, const LogSink& sink) : wake_fd_{make_eventfd()}, failure_fd_{make_eventfd()} {
  for (ProcessSpec& spec : in_start_order(std::move(specs)))
    processes_.push_back(std::make_unique<SupervisedProcess>(std::move(spec), sink));
  // Every process is spawned by this thread: the kernel ends a child with the thread that forked it (see ChildProcess).
  thread_ = std::thread{[this] { run(); }};
}

ProcessGroup::~ProcessGroup() {
  stop();
  {
    const std::scoped_lock lock{mutex_};
    quit_ = true;
  }
  wake();
  thread_.join();
}

void ProcessGroup::wake() const noexcept { ::eventfd_write(wake_fd_.get(), 1); }

SupervisedProcess& ProcessGroup::at(const std::string& name) const {
  const auto found = std::ranges::find(processes_, name, [](const auto& process) { return process->info().name; });
  if (found == processes_.end()) throw std::invalid_argument{"no process is called " + name};
  return **found;
}

Result<Ok, LaunchFailure> ProcessGroup::start() {
  std::set<std::string> names;
  std::unique_lock lock{mutex_};
  for (const auto& process : processes_) names.insert(process->info().name);
  failure_.reset();
  eventfd_t ignored = 0;
  ::eventfd_read(failure_fd_.get(), &ignored);
  to_start_ = names;
  auto result = wait_ready(lock, names);
  lock.unlock();
  if (!result) stop();
  return result;
}

Result<Ok, LaunchFailure> ProcessGroup::start(const std::string& name) {
  std::unique_lock lock{mutex_};
  at(name);  // throws for an unknown one
  if (failure_ && failure_->process == name) failure_.reset();
  to_start_now_.insert(name);
  return wait_ready(lock, {name});
}

Result<Ok, LaunchFailure> ProcessGroup::wait_ready(std::unique_lock<std::mutex>& lock, const std::set<std::string>& names) {
  wake();
  const SupervisedProcess* failed = nullptr;
  changed_.wait(lock, [&] {
    bool all_ready = true;
    for (const std::string& name : names) {
      if (to_start_.contains(name) || to_start_now_.contains(name)) {
        all_ready = false;
        continue;
      }
      const SupervisedProcess& process = at(name);
      if (process.ended() || process.info().state == ProcessState::kStopped || to_stop_.contains(name)) {
        failed = &process;
        return true;
      }
      all_ready = all_ready && process.info().state == ProcessState::kReady;
    }
    return all_ready;
  });
  if (failed != nullptr) return failure_of(*failed);
  return Ok{};
}

void ProcessGroup::stop() {
  std::unique_lock lock{mutex_};
  to_start_.clear();
  to_start_now_.clear();
  for (const auto& process : processes_) to_stop_.insert(process->info().name);
  wake();
  changed_.wait(lock, [this] { return to_stop_.empty(); });
}

void ProcessGroup::stop(const std::string& name) {
  std::unique_lock lock{mutex_};
  at(name);
  to_start_.erase(name);
  to_start_now_.erase(name);
  to_stop_.insert(name);
  wake();
  changed_.wait(lock, [&] { return !to_stop_.contains(name); });
}

void ProcessGroup::send(const std::string& name, int signal) {
  const std::scoped_lock lock{mutex_};
  at(name).send(signal);
}

ProcessInfo ProcessGroup::info(const std::string& name) const {
  const std::scoped_lock lock{mutex_};
  return at(name).info();
}

std::vector<ProcessInfo> ProcessGroup::infos() const {
  const std::scoped_lock lock{mutex_};
  std::vector<ProcessInfo> result;
  for (const auto& process : processes_) result.push_back(process->info());
  return result;
}

std::vector<std::string> ProcessGroup::log(const std::string& name) const {
  const std::scoped_lock lock{mutex_};
  const auto& lines = at(name).log();
  return {lines.begin(), lines.end()};
}

bool ProcessGroup::wait_until(const std::string& name, const std::function<bool(const ProcessInfo&)>& condition, Duration timeout) const {
  std::unique_lock lock{mutex_};
  const SupervisedProcess& process = at(name);
  return changed_.wait_for(lock, timeout, [&] { return condition(process.info()); });
}

std::optional<LaunchFailure> ProcessGroup::failure() const {
  const std::scoped_lock lock{mutex_};
  return failure_;
}

LaunchFailure ProcessGroup::failure_of(const SupervisedProcess& process) const {
  LaunchFailure failure;
  failure.process = process.info().name;
  failure.reason = process.ended() ? process.info().reason : "stopped before it was READY";
  failure.status = process.info().status;
  const auto& lines = process.log();
  failure.last_lines.assign(lines.end() - static_cast<std::ptrdiff_t>(std::min(kLinesInFailure, lines.size())), lines.end());
  return failure;
}

void ProcessGroup::start_what_may(Clock::time_point now) {
  for (const auto& process : processes_) {
    const std::string& name = process->info().name;
    const bool its_turn = std::ranges::all_of(process->spec().after,
                                              [this](const std::string& other) { return at(other).info().state == ProcessState::kReady; });
    if (to_start_now_.contains(name) || (to_start_.contains(name) && its_turn)) {
      process->start(now);
      to_start_.erase(name);
      to_start_now_.erase(name);
    }
  }
}

void ProcessGroup::stop_what_may(Clock::time_point now) {
  for (const auto& process : processes_) {
    const std::string& name = process->info().name;
    if (!to_stop_.contains(name)) continue;
    const bool still_needed = std::ranges::any_of(processes_, [&](const auto& other) {
      return to_stop_.contains(other->info().name) && other->running() && std::ranges::count(other->spec().after, name) != 0;
    });
    if (!still_needed || !process->running()) process->request_stop(now);
  }
  std::erase_if(to_stop_, [this](const std::string& name) { return at(name).at_rest(); });
}

void ProcessGroup::step(Clock::time_point now) {
  for (const auto& process : processes_) process->on_deadline(now);
  start_what_may(now);
  for (const auto& process : processes_) {
    if (failure_ || !process->ended() || to_stop_.contains(process->info().name)) continue;
    failure_ = failure_of(*process);
    ::eventfd_write(failure_fd_.get(), 1);
  }
  stop_what_may(now);
}

int ProcessGroup::poll_timeout_ms(Clock::time_point now) const {
  std::optional<Clock::time_point> next;
  for (const auto& process : processes_) {
    if (const auto deadline = process->deadline(); deadline && (!next || *deadline < *next)) next = deadline;
  }
  if (!next) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(*next - now).count();
  constexpr std::int64_t kMinute = 60'000;
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, kMinute));
}

void ProcessGroup::run() {
  enum class Source : std::uint8_t { kWake, kNotify, kOutput, kExit };
  struct Watched {
    SupervisedProcess* process;
    Source source;
  };
  std::vector<pollfd> descriptors;
  std::vector<Watched> watched;

  std::unique_lock lock{mutex_};
  while (!quit_) {
    step(Clock::now());
    changed_.notify_all();

    descriptors.assign(1, {wake_fd_.get(), POLLIN, 0});
    watched.assign(1, {nullptr, Source::kWake});
    for (const auto& process : processes_) {
      // Output before exit: a process's last lines come before the news of its end.
      for (const auto& [fd, source] : {std::pair{process->notify_fd(), Source::kNotify}, std::pair{process->output_fd(), Source::kOutput},
                                       std::pair{process->exit_fd(), Source::kExit}}) {
        if (fd < 0) continue;
        descriptors.push_back({fd, POLLIN, 0});
        watched.push_back({process.get(), source});
      }
    }
    const int timeout_ms = poll_timeout_ms(Clock::now());
    lock.unlock();
    ::poll(descriptors.data(), descriptors.size(), timeout_ms);
    lock.lock();

    const Clock::time_point now = Clock::now();
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      if (descriptors[i].revents == 0) continue;
      switch (watched[i].source) {
        case Source::kWake: {
          eventfd_t ignored = 0;
          ::eventfd_read(wake_fd_.get(), &ignored);
          break;
        }
        case Source::kNotify: watched[i].process->on_notify_readable(now); break;
        case Source::kOutput: watched[i].process->on_output_readable(); break;
        case Source::kExit: watched[i].process->on_exit_readable(now); break;
      }
    }
  }
}

}  // namespace breakshot::launcher
