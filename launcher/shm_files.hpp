#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace breakshot::launcher {

/// What remove_stale_shm() did.
struct ShmCleanup {
  std::vector<std::string> removed;  ///< file names
  std::vector<std::string> in_use;   ///< of our user's, and open or mapped in some process
  std::vector<std::string> failed;   ///< "name: reason"
};

/// Removes the shared-memory files that Fast DDS leaves behind when a process is killed: `fast_datasharing_*`, `fastrtps_*` and
/// `sem.fastrtps_*` in `folder`, if they belong to our user and no process maps or has open. (`fastdds shm clean` of 2.9 leaves the
/// data-sharing files.)
///
/// Files of a process that is just starting are safe: it keeps them open from their creation on.
///
/// @throws std::filesystem::filesystem_error when `folder` or /proc cannot be read
ShmCleanup remove_stale_shm(const std::filesystem::path& folder = "/dev/shm");

}  // namespace breakshot::launcher
