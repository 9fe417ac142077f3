#pragma once

#include <stdexcept>
#include <string>

namespace breakshot::process {

/// Another process already plays this role in this cell.
class RoleTaken : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Holds a role (e.g. "controller") in one cell of this machine, so that two controllers never command one arm.
///
/// An abstract Unix socket named after domain and role: the kernel frees it when the process ends, however it ends, and it needs no file and no
/// writable folder.
class RoleLock {
 public:
  /// @throws RoleTaken with the holder's process number when it is taken
  RoleLock(int cell_domain, const std::string& role);
  ~RoleLock();
  RoleLock(const RoleLock&) = delete;
  RoleLock& operator=(const RoleLock&) = delete;
  RoleLock(RoleLock&&) = delete;
  RoleLock& operator=(RoleLock&&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace breakshot::process
