#include "launcher/child_process.hpp"

#include "launcher/pidfd.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

namespace breakshot::launcher {
namespace {

/// "KEY=VALUE" strings: the caller's environment without systemd's words for the caller, then what the spec adds.
std::vector<std::string> environment_of(const ProcessSpec& spec, const std::string& notify_address) {
  std::vector<std::pair<std::string, std::string>> added = spec.environment;
  added.emplace_back("NOTIFY_SOCKET", notify_address);
  if (spec.watchdog > Duration::zero()) {
    added.emplace_back("WATCHDOG_USEC", std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(spec.watchdog).count()));
  }
  const auto replaced = [&](std::string_view key) {
    constexpr std::array<std::string_view, 5> kSystemd{"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "LISTEN_FDS", "LISTEN_PID"};
    return std::ranges::find(kSystemd, key) != kSystemd.end() ||
           std::ranges::any_of(added, [&](const auto& entry) { return entry.first == key; });
  };
  std::vector<std::string> result;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text{*entry};
    if (!replaced(text.substr(0, text.find('=')))) result.emplace_back(text);
  }
  for (const auto& [key, value] : added) result.push_back(key + "=" + value);
  return result;
}

std::vector<char*> pointers_to(std::vector<std::string>& strings) {
  std::vector<char*> result;
  result.reserve(strings.size() + 1);
  for (std::string& text : strings) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

/// Between fork and exec of a process that may have many threads: only async-signal-safe calls (signal-safety(7)).
[[noreturn]] void exec_in_child(const char* program, char* const* arguments, char* const* environment, pid_t parent, int output,
                                int errno_pipe) noexcept {
  const auto give_up = [&]() {
    const int error = errno;
    [[maybe_unused]] const ssize_t written = ::write(errno_pipe, &error, sizeof error);
    ::_exit(127);
  };
  // The parent may have died before the request to be told; then nobody would ever end this child.
  if (::prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) give_up();
  if (::getppid() != parent) ::_exit(127);
  ::setpgid(0, 0);

  for (int signal = 1; signal < NSIG; ++signal) ::signal(signal, SIG_DFL);  // refused for SIGKILL and SIGSTOP, which is fine
  sigset_t none;
  ::sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);

  const int null = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (null < 0 || ::dup2(null, STDIN_FILENO) < 0 || ::dup2(output, STDOUT_FILENO) < 0 || ::dup2(output, STDERR_FILENO) < 0) give_up();
  // Whatever the caller has open (sockets, DDS ports) is not the child's, marked close-on-exec or not.
  ::close_range(STDERR_FILENO + 1, ~0U, CLOSE_RANGE_CLOEXEC);
  ::execve(program, arguments, environment);
  give_up();
  ::_exit(127);
}

}  // namespace

bool ExitStatus::clean() const noexcept {
  if (!by_signal) return code == 0;
  return code == SIGHUP || code == SIGINT || code == SIGTERM || code == SIGPIPE;
}

std::string describe(const ExitStatus& status) {
  if (!status.by_signal) return "exited with code " + std::to_string(status.code);
  const char* name = ::sigabbrev_np(status.code);
  return "killed by " + (name != nullptr ? "SIG" + std::string{name} : "signal " + std::to_string(status.code));
}

Result<ChildProcess, std::string> ChildProcess::spawn(const ProcessSpec& spec, const std::string& notify_address) {
  const auto error_text = [&](const char* what, int error) {
    return std::string{what} + spec.program.string() + ": " + std::generic_category().message(error);
  };

  std::vector<std::string> arguments{spec.program.string()};
  arguments.insert(arguments.end(), spec.arguments.begin(), spec.arguments.end());
  std::vector<std::string> environment = environment_of(spec, notify_address);
  const std::vector<char*> argv = pointers_to(arguments);
  const std::vector<char*> envp = pointers_to(environment);

  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return error_text("no pipe for ", errno);
  UniqueFd output_read{ends[0]};
  UniqueFd output_write{ends[1]};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return error_text("no pipe for ", errno);
  UniqueFd errno_read{ends[0]};
  UniqueFd errno_write{ends[1]};

  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) return error_text("cannot fork for ", errno);
  if (pid == 0) exec_in_child(argv[0], argv.data(), envp.data(), parent, output_write.get(), errno_write.get());

  // exec closes the pipe without a word; a failure before it sends its errno.
  errno_write.reset();
  int exec_error = 0;
  ssize_t size = 0;
  do {
    size = ::read(errno_read.get(), &exec_error, sizeof exec_error);
  } while (size < 0 && errno == EINTR);
  if (size == static_cast<ssize_t>(sizeof exec_error)) {
    while (::waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {
    }
    return error_text("", exec_error);
  }

  UniqueFd pidfd{::pidfd_open(pid, 0)};
  if (!pidfd) {
    const int error = errno;
    ::kill(pid, SIGKILL);
    while (::waitpid(pid, nullptr, 0) < 0 && errno == EINTR) {
    }
    return error_text("no pidfd for ", error);
  }
  ::fcntl(output_read.get(), F_SETFL, O_NONBLOCK);
  return ChildProcess{pid, std::move(pidfd), std::move(output_read)};
}

void ChildProcess::send(int signal) noexcept { ::pidfd_send_signal(pidfd_.get(), signal, nullptr, 0); }

std::optional<ExitStatus> ChildProcess::try_reap() noexcept {
  siginfo_t info{};
  if (::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid != pid_) return std::nullopt;
  // The group first: as long as its leader is not reaped, its number cannot belong to anyone else.
  ::kill(-pid_, SIGKILL);

  int raw = 0;
  rusage usage{};
  if (::wait4(pid_, &raw, 0, &usage) != pid_) return std::nullopt;
  const auto time_of = [](const timeval& time) { return std::chrono::seconds{time.tv_sec} + std::chrono::microseconds{time.tv_usec}; };
  return ExitStatus{
      .by_signal = WIFSIGNALED(raw),
      .code = WIFSIGNALED(raw) ? WTERMSIG(raw) : WEXITSTATUS(raw),
      .cpu_time = time_of(usage.ru_utime) + time_of(usage.ru_stime),
      .peak_rss_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024,
  };
}

}  // namespace breakshot::launcher
