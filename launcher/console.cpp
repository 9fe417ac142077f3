#include "launcher/console.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>

namespace breakshot::launcher {
namespace {

// Foreground colours that read on light and dark terminals alike (ECMA-48 SGR); red is left to errors.
constexpr std::array<const char*, 6> kColours{"\033[36m", "\033[33m", "\033[32m", "\033[35m", "\033[34m", "\033[96m"};
constexpr const char* kReset = "\033[0m";

/// As common/process/logging.cpp writes levels.
bool is_error(const std::string& line) {
  return line.find("Z error ") != std::string::npos || line.find("Z critical ") != std::string::npos;
}

}  // namespace

Console::Console(std::FILE* stream, Show show, const std::vector<std::string>& processes) : stream_{stream}, show_{show} {
  std::size_t width = 0;
  for (const std::string& name : processes) width = std::max(width, name.size());
  const bool coloured = ::isatty(::fileno(stream)) == 1;
  for (std::size_t i = 0; i < processes.size(); ++i) {
    std::string padded = processes[i];
    padded.resize(width, ' ');
    prefixes_[processes[i]] = coloured ? kColours[i % kColours.size()] + padded + " |" + kReset + " " : padded + " | ";
  }
}

void Console::log_to(const std::string& process, const std::filesystem::path& file) {
  const std::scoped_lock lock{mutex_};
  files_[process].open(file, std::ios::app);
}

void Console::process_line(const std::string& process, const std::string& line) {
  const std::scoped_lock lock{mutex_};
  if (const auto file = files_.find(process); file != files_.end()) file->second << line << std::endl;
  if (show_ == Show::kErrors && !is_error(line)) return;
  std::fprintf(stream_, "%s%s\n", prefixes_[process].c_str(), line.c_str());
  std::fflush(stream_);
}

void Console::say(const std::string& text) {
  const std::scoped_lock lock{mutex_};
  std::fprintf(stream_, "%s\n", text.c_str());
  std::fflush(stream_);
}

}  // namespace breakshot::launcher
