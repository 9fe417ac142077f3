#include "launcher/foreground_command.hpp"

#include "launcher/pidfd.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace breakshot::launcher {

namespace {

/// In the child. The command ends with the launcher, also with one that was killed: the cell that it was for is then gone.
[[noreturn]] void exec_in_child(char* const* arguments, pid_t parent, int errno_pipe) noexcept {
  const bool bound = ::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0;
  if (::getppid() != parent) ::_exit(127);  // it died before the request to be told
  // The launcher blocks the signals that it waits for; the command is to have them.
  sigset_t none;
  ::sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  if (bound) ::execvp(arguments[0], arguments);
  const int error = errno;
  [[maybe_unused]] const ssize_t written = ::write(errno_pipe, &error, sizeof error);
  ::_exit(127);
}

}  // namespace

ForegroundCommand::ForegroundCommand(const std::vector<std::string>& words) {
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error{errno, std::generic_category(), words.front()};
  UniqueFd errno_read{ends[0]};
  UniqueFd errno_write{ends[1]};
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0) throw std::system_error{errno, std::generic_category(), words.front()};
  if (pid_ == 0) exec_in_child(arguments.data(), parent, errno_write.get());

  // exec closes the pipe without a word; a failure before it sends its errno.
  errno_write.reset();
  int error = 0;
  ssize_t size = 0;
  do {
    size = ::read(errno_read.get(), &error, sizeof error);
  } while (size < 0 && errno == EINTR);
  if (size == static_cast<ssize_t>(sizeof error)) {
    wait();
    throw std::system_error{error, std::generic_category(), words.front()};
  }
  pidfd_ = UniqueFd{::pidfd_open(pid_, 0)};
}

ForegroundCommand::~ForegroundCommand() {
  if (pid_ < 0) return;
  send(SIGKILL);
  wait();
}

void ForegroundCommand::send(int signal) noexcept {
  if (pid_ >= 0) ::kill(pid_, signal);  // not reaped yet, so the number is still its own
}

int ForegroundCommand::wait() noexcept {
  int raw = 0;
  while (::waitpid(pid_, &raw, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  constexpr int kSignalBase = 128;
  return WIFSIGNALED(raw) ? kSignalBase + WTERMSIG(raw) : WEXITSTATUS(raw);
}

}  // namespace breakshot::launcher
