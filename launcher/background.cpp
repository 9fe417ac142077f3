#include "launcher/background.hpp"

#include "launcher/unique_fd.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <system_error>

namespace breakshot::launcher {
namespace {

/// Last byte on the pipe of a body that is ready; its text never holds one.
constexpr char kReadyMark = '\0';

volatile std::sig_atomic_t background_pid = 0;
extern "C" void pass_on(int /*signal*/) { ::kill(background_pid, SIGTERM); }

/// Shows what comes through the pipe. @return whether it ended with the mark
bool relay(int pipe) {
  bool ready = false;
  std::array<char, 4096> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by read
  while (true) {
    const ssize_t size = ::read(pipe, buffer.data(), buffer.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return ready;
    std::string_view text{buffer.data(), static_cast<std::size_t>(size)};
    if (text.ends_with(kReadyMark)) {
      ready = true;
      text.remove_suffix(1);
    }
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }
}

void redirect_output(int fd) {
  std::fflush(nullptr);
  ::dup2(fd, STDOUT_FILENO);
  ::dup2(fd, STDERR_FILENO);
}

}  // namespace

int run_in_background(const std::filesystem::path& log_file, const std::function<int(const std::function<void()>& ready)>& body) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error{errno, std::generic_category(), "pipe"};
  UniqueFd read_end{ends[0]};
  UniqueFd write_end{ends[1]};
  std::fflush(nullptr);
  const pid_t pid = ::fork();
  if (pid < 0) throw std::system_error{errno, std::generic_category(), "fork"};

  if (pid == 0) {
    read_end.reset();
    ::setsid();
    redirect_output(write_end.get());
    const UniqueFd null{::open("/dev/null", O_RDONLY | O_CLOEXEC)};
    ::dup2(null.get(), STDIN_FILENO);
    const int status = body([&] {
      std::fflush(nullptr);
      [[maybe_unused]] const ssize_t written = ::write(write_end.get(), &kReadyMark, 1);
      const UniqueFd log{::open(log_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)};
      redirect_output(log ? log.get() : null.get());
      write_end.reset();
    });
    std::fflush(nullptr);
    std::_Exit(status);
  }

  write_end.reset();
  background_pid = pid;
  std::signal(SIGINT, pass_on);
  std::signal(SIGTERM, pass_on);
  if (relay(read_end.get())) return 0;
  int raw = 0;
  while (::waitpid(pid, &raw, 0) < 0 && errno == EINTR) {
  }
  constexpr int kSignalBase = 128;  // as a shell says it
  return WIFSIGNALED(raw) ? kSignalBase + WTERMSIG(raw) : WEXITSTATUS(raw);
}

}  // namespace breakshot::launcher
