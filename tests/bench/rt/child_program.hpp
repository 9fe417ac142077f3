#pragma once

#include "common/time.hpp"
#include "launcher/child_process.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace breakshot::bench {

/// A program that a benchmark needs beside it. It is killed, with its children, when the object goes or the thread that made it ends.
class ChildProgram {
 public:
  /// Finds it on the PATH and starts it.
  /// @param package  of Debian, that has it
  /// @throws std::runtime_error when it is not there or does not start, with what to do
  ChildProgram(const std::string& name, const std::string& package, const std::vector<std::string>& arguments);
  /// Starts this very program again, with other arguments.
  explicit ChildProgram(const std::vector<std::string>& arguments);
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;
  ChildProgram(ChildProgram&&) = delete;
  ChildProgram& operator=(ChildProgram&&) = delete;

  /// Waits until it ends.
  /// @return what it printed
  /// @throws std::runtime_error when it fails, or has not ended after `patience`
  std::string wait(Duration patience);

 private:
  ChildProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments);
  void read_output();

  std::string name_;
  launcher::ChildProcess process_;
  std::string output_;
  bool ended_ = false;
};

/// The program's path. @throws std::runtime_error when it is not on the PATH, with what to do
std::filesystem::path find_program(const std::string& name, const std::string& package);

}  // namespace breakshot::bench
