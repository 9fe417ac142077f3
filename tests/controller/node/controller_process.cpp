#include "tests/controller/node/controller_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <system_error>
#include <thread>

namespace breakshot::control::test {

namespace {

constexpr Duration kLook = std::chrono::milliseconds{5};

}  // namespace

ControllerProcess::ControllerProcess(const std::vector<std::string>& overrides) {
  static int count = 0;
  log_path_ = std::string{BREAKSHOT_BINARY_DIR} + "/tests/controller_node_test." + std::to_string(getpid()) + "." +
              std::to_string(++count) + ".log";
  std::vector<std::string> words{std::string{BREAKSHOT_BINARY_DIR} + "/bin/breakshot-controller", "--config",
                                 std::string{BREAKSHOT_SOURCE_DIR} + "/config/cell.yaml"};
  for (const auto& override_ : overrides) {
    words.push_back("--set");
    words.push_back(override_);
  }
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  const int error = posix_spawn(&pid_, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::system_error(error, std::generic_category(), words[0]);
}

ControllerProcess::~ControllerProcess() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  unlink(log_path_.c_str());
}

void ControllerProcess::signal(int number) const { kill(pid_, number); }

std::optional<int> ControllerProcess::wait(Duration patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  while (std::chrono::steady_clock::now() < until) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    std::this_thread::sleep_for(kLook);
  }
  return std::nullopt;
}

std::string ControllerProcess::log() const {
  std::ostringstream text;
  text << std::ifstream{log_path_}.rdbuf();
  return text.str();
}

bool ControllerProcess::says(const std::string& text, Duration patience) const {
  const auto until = std::chrono::steady_clock::now() + patience;
  while (log().find(text) == std::string::npos) {
    if (std::chrono::steady_clock::now() >= until) return false;
    std::this_thread::sleep_for(kLook);
  }
  return true;
}

}  // namespace breakshot::control::test
