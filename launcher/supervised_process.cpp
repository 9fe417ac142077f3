#include "launcher/supervised_process.hpp"

#include <signal.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <system_error>
#include <utility>

namespace breakshot::launcher {
namespace {

/// Lines kept per process for failure messages and tests; about a minute of a chatty process.
constexpr std::size_t kKeptLines = 2000;
/// A line longer than this is cut in two, so that a process that never ends a line cannot eat the launcher's memory.
constexpr std::size_t kLongestLine = 8192;

/// "0.2 s", "20 s".
std::string in_seconds(Duration duration) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g s", to_seconds(duration));
  return text.data();
}

}  // namespace

const char* to_string(ProcessState state) noexcept {
  switch (state) {
    case ProcessState::kStopped: return "stopped";
    case ProcessState::kStarting: return "starting";
    case ProcessState::kReady: return "ready";
    case ProcessState::kStopping: return "stopping";
    case ProcessState::kRestarting: return "restarting";
    case ProcessState::kExited: return "exited";
    case ProcessState::kFailed: return "failed";
  }
  return "unknown";
}

SupervisedProcess::SupervisedProcess(ProcessSpec spec, LogSink sink) : spec_{std::move(spec)}, sink_{std::move(sink)} {
  info_.name = spec_.name;
}

void SupervisedProcess::start(Clock::time_point now) {
  if (!at_rest()) return;
  info_.restarts = 0;
  was_ready_ = false;
  starts_.clear();
  spawn(now);
}

void SupervisedProcess::spawn(Clock::time_point now) {
  asked_to_stop_ = false;
  verdict_.reset();
  starts_.push_back(now);
  info_.started = now;
  info_.status.clear();
  info_.reason.clear();
  const auto refuse = [&](std::string why) {
    info_.state = ProcessState::kFailed;
    info_.reason = std::move(why);
    deadline_.reset();
  };
  try {
    notify_.emplace();
  } catch (const std::system_error& error) {
    return refuse(error.what());
  }
  auto child = ChildProcess::spawn(spec_, notify_->address());
  if (!child) return refuse("could not be started: " + child.error());
  child_.emplace(std::move(*child));
  output_open_ = true;
  info_.pid = child_->pid();
  info_.state = ProcessState::kStarting;
  deadline_ = now + spec_.ready_timeout;
}

void SupervisedProcess::request_stop(Clock::time_point now) {
  asked_to_stop_ = true;
  if (!child_) {
    // A death that waited for its restart stays a stop: nothing of it is left to fail.
    if (info_.state == ProcessState::kRestarting) info_.state = ProcessState::kStopped;
    deadline_.reset();
    return;
  }
  if (info_.state == ProcessState::kStopping) return;
  info_.state = ProcessState::kStopping;
  deadline_ = now + spec_.stop_timeout;
  child_->send(SIGTERM);
  child_->send(SIGCONT);  // a stopped process hears nothing
}

void SupervisedProcess::send(int signal) {
  if (child_) child_->send(signal);
}

void SupervisedProcess::give_up_on(std::string why, int signal, Clock::time_point now) {
  verdict_ = std::move(why);
  info_.state = ProcessState::kStopping;
  deadline_ = now + spec_.stop_timeout;
  child_->send(signal);
  child_->send(SIGCONT);
}

void SupervisedProcess::on_notify_readable(Clock::time_point now) {
  if (!child_) return;
  while (const auto notification = notify_->receive(child_->pid())) {
    if (notification->status) info_.status = *notification->status;
    const bool first_ready = notification->ready && info_.state == ProcessState::kStarting;
    if (first_ready) {
      info_.state = ProcessState::kReady;
      was_ready_ = true;
      deadline_.reset();
    }
    const bool alive = first_ready || notification->watchdog;
    if (alive && info_.state == ProcessState::kReady && spec_.watchdog > Duration::zero()) deadline_ = now + spec_.watchdog;
    // A process that goes by itself has as long as one that is told to.
    if (notification->stopping && (info_.state == ProcessState::kReady || info_.state == ProcessState::kStarting)) {
      info_.state = ProcessState::kStopping;
      deadline_ = now + spec_.stop_timeout;
    }
  }
}

void SupervisedProcess::on_output_readable() {
  if (!output_open_) return;
  // At most what a pipe holds (64 KiB, pipe(7)) at a time, so that one that floods its log cannot keep the others waiting.
  constexpr int kReads = 16;
  std::array<char, 4096> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read
  for (int i = 0; i < kReads; ++i) {
    const ssize_t size = ::read(child_->output_fd(), buffer.data(), buffer.size());
    if (size < 0) return;  // nothing more for now
    if (size == 0) {
      output_open_ = false;
      return;
    }
    for (const char character : std::string_view{buffer.data(), static_cast<std::size_t>(size)}) {
      if (character != '\n') partial_line_ += character;
      if (character == '\n' || partial_line_.size() >= kLongestLine) keep_line(std::exchange(partial_line_, {}));
    }
  }
}

void SupervisedProcess::keep_line(std::string line) {
  if (sink_) sink_(spec_.name, line);
  log_.push_back(std::move(line));
  if (log_.size() > kKeptLines) log_.pop_front();
}

void SupervisedProcess::on_exit_readable(Clock::time_point now) {
  if (!child_) return;
  // Its last words first: they say why it went.
  on_notify_readable(now);
  const auto status = child_->try_reap();
  if (!status) return;
  on_output_readable();
  if (!partial_line_.empty()) keep_line(std::exchange(partial_line_, {}));
  output_open_ = false;
  child_.reset();
  notify_.reset();
  info_.pid = 0;
  settle(*status, now);
}

void SupervisedProcess::settle(const ExitStatus& status, Clock::time_point now) {
  info_.ran += now - info_.started;
  info_.cpu_time += status.cpu_time;
  info_.peak_rss_bytes = std::max(info_.peak_rss_bytes, status.peak_rss_bytes);
  deadline_.reset();
  info_.reason = verdict_ ? *verdict_ : describe(status);
  if (asked_to_stop_) {
    info_.state = ProcessState::kStopped;
    return;
  }
  if (!verdict_ && status.clean()) {
    info_.state = ProcessState::kExited;
    return;
  }

  info_.state = ProcessState::kFailed;
  const bool hopeless = !status.by_signal && std::ranges::count(spec_.restart.prevent_exit_codes, status.code) != 0;
  if (!spec_.restart.on_failure || !was_ready_ || hopeless) return;
  std::erase_if(starts_, [&](Clock::time_point start) { return now - start > spec_.restart.start_limit_interval; });
  if (static_cast<int>(starts_.size()) >= spec_.restart.start_limit_burst) {
    info_.reason +=
        "; given up after " + std::to_string(starts_.size()) + " starts within " + in_seconds(spec_.restart.start_limit_interval);
    return;
  }
  info_.state = ProcessState::kRestarting;
  deadline_ = now + spec_.restart.delay;
}

void SupervisedProcess::on_deadline(Clock::time_point now) {
  if (!deadline_ || now < *deadline_) return;
  switch (info_.state) {
    case ProcessState::kStarting: give_up_on("not READY within " + in_seconds(spec_.ready_timeout), SIGTERM, now); break;
    case ProcessState::kReady:
      // SIGABRT as systemd does: a core dump shows where it hung.
      give_up_on("watchdog: no sign of life for " + in_seconds(spec_.watchdog), SIGABRT, now);
      break;
    case ProcessState::kStopping:
      if (!verdict_) verdict_ = "did not stop within " + in_seconds(spec_.stop_timeout) + " and was killed";
      deadline_.reset();
      child_->send(SIGKILL);
      break;
    case ProcessState::kRestarting:
      ++info_.restarts;
      spawn(now);
      break;
    case ProcessState::kStopped:
    case ProcessState::kExited:
    case ProcessState::kFailed: deadline_.reset(); break;
  }
}

}  // namespace breakshot::launcher
