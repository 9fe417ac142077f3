#include "common/process/role_lock.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <system_error>

namespace breakshot::process {

namespace {

struct Address {
  sockaddr_un name{};
  socklen_t length = 0;

  explicit Address(const std::string& text) {
    name.sun_family = AF_UNIX;
    // A leading zero byte makes the name abstract.
    const std::size_t copied = std::min(text.size(), sizeof(name.sun_path) - 1);
    std::memcpy(name.sun_path + 1, text.data(), copied);
    length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + copied);
  }
  const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&name); }  // NOLINT: the sockets API asks for it
};

/// Process number of whoever listens there; 0 when it cannot be learnt.
int holder_of(const Address& address) noexcept {
  const int peer = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ucred credentials{};
  socklen_t size = sizeof(credentials);
  if (connect(peer, address.get(), address.length) == 0) getsockopt(peer, SOL_SOCKET, SO_PEERCRED, &credentials, &size);
  close(peer);
  return credentials.pid;
}

}  // namespace

RoleLock::RoleLock(int cell_domain, const std::string& role) {
  const Address address{fmt::format("breakshot/{}/{}", cell_domain, role)};
  socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket_ < 0) throw std::system_error(errno, std::generic_category(), "role lock: socket");
  if (bind(socket_, address.get(), address.length) == 0 && listen(socket_, 8) == 0) return;
  const int error = errno;
  close(socket_);
  if (error == EADDRINUSE) {
    throw RoleTaken(
        fmt::format("cell domain {} already has a {} (process {}): stop it first, or give this cell another `cell.dds.cell_domain`",
                    cell_domain, role, holder_of(address)));
  }
  throw std::system_error(error, std::generic_category(), "role lock: bind");
}

RoleLock::~RoleLock() { close(socket_); }

}  // namespace breakshot::process
