// A process for the launcher to start. Its arguments are done one after the other:
//   say TEXT        print a line             mumble TEXT   print without ending the line
//   notify TEXT     send it to NOTIFY_SOCKET
//   ready           notify READY=1           env NAME      print the variable, or "NAME is not set"
//   await-signal    wait for SIGUSR1         wait          wait for SIGTERM, then go on
//   ignore-term     from now on SIGTERM does nothing
//   hang            wait for ever            fork          start a child of its own that hangs, print its pid
//   exit CODE       exit                     crash         die of SIGSEGV
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

void notify(const std::string& text) {
  const char* name = std::getenv("NOTIFY_SOCKET");
  if (name == nullptr) return;
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = std::strlen(name);
  std::memcpy(address.sun_path, name, length);
  if (address.sun_path[0] == '@') address.sun_path[0] = '\0';
  ::sendto(fd, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&address),
           static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length));
  ::close(fd);
}

void wait_for(int signal) {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, signal);
  int got = 0;
  sigwait(&set, &got);
}

[[noreturn]] void hang() {
  while (true) ::pause();
}

}  // namespace

int main(int argc, char** argv) {
  // Blocked until waited for, so that none is lost before.
  sigset_t awaited;
  sigemptyset(&awaited);
  sigaddset(&awaited, SIGUSR1);
  bool waits_for_term = false;
  for (int i = 1; i < argc; ++i) waits_for_term = waits_for_term || std::string{argv[i]} == "wait";
  if (waits_for_term) sigaddset(&awaited, SIGTERM);
  sigprocmask(SIG_BLOCK, &awaited, nullptr);

  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto operand = [&]() { return std::string{i + 1 < argc ? argv[++i] : ""}; };
    if (word == "say") std::printf("%s\n", operand().c_str());
    if (word == "mumble") std::printf("%s", operand().c_str());
    if (word == "notify") notify(operand());
    if (word == "ready") notify("READY=1\nSTATUS=at work");
    if (word == "env") {
      const std::string name = operand();
      const char* value = std::getenv(name.c_str());
      std::printf("%s %s\n", name.c_str(), value != nullptr ? value : "is not set");
    }
    if (word == "await-signal") wait_for(SIGUSR1);
    if (word == "wait") wait_for(SIGTERM);
    if (word == "ignore-term") std::signal(SIGTERM, SIG_IGN);
    if (word == "fork") {
      const pid_t child = ::fork();
      if (child == 0) hang();
      std::printf("child %d\n", child);
    }
    if (word == "exit") return std::atoi(operand().c_str());
    if (word == "crash") {
      std::signal(SIGSEGV, SIG_DFL);  // a sanitizer has a handler of its own
      std::raise(SIGSEGV);
    }
    std::fflush(stdout);
    if (word == "hang") hang();
  }
  return 0;
}
