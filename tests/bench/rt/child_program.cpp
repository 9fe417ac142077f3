#include "tests/bench/rt/child_program.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace breakshot::bench {

namespace {

constexpr Duration kLook = std::chrono::milliseconds{20};
/// From SIGTERM to SIGKILL: stress-ng ends its children by itself.
constexpr Duration kGoodbye = std::chrono::seconds{5};

launcher::ChildProcess spawn(const std::filesystem::path& program, const std::vector<std::string>& arguments) {
  launcher::ProcessSpec spec;
  spec.program = program;
  spec.arguments = arguments;
  auto child = launcher::ChildProcess::spawn(spec, "");
  if (!child) throw std::runtime_error(child.error());
  return std::move(*child);
}

}  // namespace

std::filesystem::path find_program(const std::string& name, const std::string& package) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders{path == nullptr ? "" : path};
  for (std::string folder; std::getline(folders, folder, ':');) {
    auto program = std::filesystem::path{folder} / name;
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  throw std::runtime_error(fmt::format("{} is not installed: `./breakshot setup` installs it (Debian package {})", name, package));
}

ChildProgram::ChildProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments)
    : name_{program.filename()}, process_{spawn(program, arguments)} {}

ChildProgram::ChildProgram(const std::string& name, const std::string& package, const std::vector<std::string>& arguments)
    : ChildProgram{find_program(name, package), arguments} {}

ChildProgram::ChildProgram(const std::vector<std::string>& arguments)
    : ChildProgram{std::filesystem::read_symlink("/proc/self/exe"), arguments} {}

ChildProgram::~ChildProgram() {
  if (ended_) return;
  process_.send(SIGTERM);
  const auto until = std::chrono::steady_clock::now() + kGoodbye;
  while (!process_.try_reap()) {
    if (std::chrono::steady_clock::now() > until) process_.send(SIGKILL);
    std::this_thread::sleep_for(kLook);
  }
}

void ChildProgram::read_output() {
  std::array<char, 4096> block{};
  for (ssize_t size = 0; (size = read(process_.output_fd(), block.data(), block.size())) > 0;)
    output_.append(block.data(), static_cast<std::size_t>(size));
}

std::string ChildProgram::wait(Duration patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  std::optional<launcher::ExitStatus> status;
  while (!(status = process_.try_reap())) {
    if (std::chrono::steady_clock::now() > until)
      throw std::runtime_error(fmt::format("{} has not ended after {:.0f} s", name_, to_seconds(patience)));
    // Its exit wakes this up; the time-out is for its output, which must not fill the pipe.
    pollfd ended{process_.exit_fd(), POLLIN, 0};
    poll(&ended, 1, static_cast<int>(kLook / std::chrono::milliseconds{1}));
    read_output();
  }
  ended_ = true;
  read_output();
  if (!status->clean()) throw std::runtime_error(fmt::format("{} {}: {}", name_, launcher::describe(*status), output_));
  return output_;
}

}  // namespace breakshot::bench
