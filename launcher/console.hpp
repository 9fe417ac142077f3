#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace breakshot::launcher {

/// Where the lines of the launcher and of its processes go: to the terminal, each behind its process's name, and to a file per process.
/// Any thread may call it.
class Console {
 public:
  enum class Show : std::uint8_t {
    kAll,     ///< every line of every process
    kErrors,  ///< of the processes only what they log as error or critical
  };

  /// @param processes  their names, for the width of the prefix and the choice of colours (on a terminal only)
  Console(std::FILE* stream, Show show, const std::vector<std::string>& processes);

  /// Also writes the process's lines to this file from now on.
  void log_to(const std::string& process, const std::filesystem::path& file);

  /// A line of a process.
  void process_line(const std::string& process, const std::string& line);
  /// Lines of the launcher itself.
  void say(const std::string& text);

 private:
  std::mutex mutex_;
  std::FILE* stream_;
  Show show_;
  std::map<std::string, std::string> prefixes_;
  std::map<std::string, std::ofstream> files_;
};

}  // namespace breakshot::launcher
