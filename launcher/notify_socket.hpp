#pragma once

#include "launcher/unique_fd.hpp"

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>

namespace breakshot::launcher {

/// What one sd_notify(3) datagram says. Fields that it does not set are false or empty; unknown ones are ignored, as systemd does.
struct Notification {
  bool ready = false;
  bool stopping = false;
  bool watchdog = false;
  std::optional<std::string> status;
};

/// Reads "KEY=VALUE" lines. Never fails: what is not understood says nothing.
Notification parse_notification(std::string_view datagram);

/// The receiving end of NOTIFY_SOCKET for one process.
///
/// The socket lives in the abstract namespace under a name that the kernel picks, so it leaves no file behind. The kernel vouches for the
/// sender's pid, and what others than the expected process send is dropped (systemd's NotifyAccess=main).
class NotifySocket {
 public:
  /// @throws std::system_error when the kernel gives no socket
  NotifySocket();

  /// Value of NOTIFY_SOCKET for the process, "@" first.
  const std::string& address() const noexcept { return address_; }
  int fd() const noexcept { return fd_.get(); }

  /// The next waiting notification from `sender`, or nothing when none waits. Does not block.
  std::optional<Notification> receive(pid_t sender);

 private:
  UniqueFd fd_;
  std::string address_;
};

}  // namespace breakshot::launcher
