#include "launcher/shm_files.hpp"

#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

namespace breakshot::launcher {
namespace {

namespace fs = std::filesystem;

/// Device and inode: what a file is, whatever path a process in another mount namespace sees it under.
using FileId = std::pair<dev_t, ino_t>;

bool is_fast_dds_name(std::string_view name) {
  constexpr std::array<std::string_view, 3> kPrefixes{"fast_datasharing_", "fastrtps_", "sem.fastrtps_"};
  return std::ranges::any_of(kPrefixes, [&](std::string_view prefix) { return name.starts_with(prefix); });
}

bool is_number(std::string_view text) { return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos; }

/// Adds what a process maps. Lines read "start-end perms offset major:minor inode path" (proc(5)).
void add_mapped(const fs::path& process, std::set<FileId>& files) {
  std::ifstream maps{process / "maps"};
  for (std::string line; std::getline(maps, line);) {
    unsigned int major = 0;
    unsigned int minor = 0;
    unsigned long inode = 0;
    if (std::sscanf(line.c_str(), "%*s %*s %*s %x:%x %lu", &major, &minor, &inode) == 3 && inode != 0) {
      files.insert({makedev(major, minor), inode});
    }
  }
}

void add_open(const fs::path& process, std::set<FileId>& files) {
  std::error_code error;  // a process that ends meanwhile, or one of another user
  for (auto entry = fs::directory_iterator{process / "fd", error}; !error && entry != fs::directory_iterator{}; entry.increment(error)) {
    struct stat info {};
    if (::stat(entry->path().c_str(), &info) == 0) files.insert({info.st_dev, info.st_ino});
  }
}

}  // namespace

ShmCleanup remove_stale_shm(const fs::path& folder) {
  // The candidates first: a file made after this look is not among them.
  std::vector<std::pair<fs::path, FileId>> candidates;
  for (const auto& entry : fs::directory_iterator{folder}) {
    struct stat info {};
    if (!is_fast_dds_name(entry.path().filename().string())) continue;
    if (::lstat(entry.path().c_str(), &info) != 0 || !S_ISREG(info.st_mode) || info.st_uid != ::geteuid()) continue;
    candidates.emplace_back(entry.path(), FileId{info.st_dev, info.st_ino});
  }
  ShmCleanup result;
  if (candidates.empty()) return result;

  std::set<FileId> used;
  for (const auto& entry : fs::directory_iterator{"/proc"}) {
    if (!is_number(entry.path().filename().string())) continue;
    add_mapped(entry.path(), used);
    add_open(entry.path(), used);
  }
  for (const auto& [path, id] : candidates) {
    const std::string name = path.filename().string();
    if (used.contains(id)) {
      result.in_use.push_back(name);
    } else if (::unlink(path.c_str()) == 0) {
      result.removed.push_back(name);
    } else if (errno != ENOENT) {
      result.failed.push_back(name + ": " + std::generic_category().message(errno));
    }
  }
  return result;
}

}  // namespace breakshot::launcher
