#include "launcher/foreground_command.hpp"

#include "launcher/pidfd.hpp"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace breakshot::launcher {

ForegroundCommand::ForegroundCommand(const std::vector<std::string>& words) {
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  // The launcher blocks the signals that it waits for; the command is to have them.
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  const int error = ::posix_spawnp(&pid_, arguments[0], nullptr, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  if (error != 0) throw std::system_error{error, std::generic_category(), words.front()};
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
