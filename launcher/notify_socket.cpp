#include "launcher/notify_socket.hpp"

#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <system_error>

namespace breakshot::launcher {
namespace {

/// systemd's own bound is one page; nothing that we understand is longer.
constexpr std::size_t kMaxDatagram = 4096;

[[noreturn]] void fail(const char* what) { throw std::system_error{errno, std::generic_category(), what}; }

}  // namespace

Notification parse_notification(std::string_view datagram) {
  Notification result;
  while (!datagram.empty()) {
    const std::size_t end = datagram.find('\n');
    const std::string_view line = datagram.substr(0, end);
    datagram.remove_prefix(end == std::string_view::npos ? datagram.size() : end + 1);
    if (line == "READY=1") result.ready = true;
    if (line == "STOPPING=1") result.stopping = true;
    if (line == "WATCHDOG=1") result.watchdog = true;
    if (line.starts_with("STATUS=")) result.status = std::string{line.substr(std::strlen("STATUS="))};
  }
  return result;
}

NotifySocket::NotifySocket() : fd_{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)} {
  if (!fd_) fail("notify socket");
  const int on = 1;
  if (::setsockopt(fd_.get(), SOL_SOCKET, SO_PASSCRED, &on, sizeof on) != 0) fail("notify socket: SO_PASSCRED");

  // Binding to the family alone lets the kernel choose an unused abstract name (unix(7), "Autobind feature").
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address.sun_family) != 0) fail("notify socket: bind");
  socklen_t length = sizeof address;
  if (::getsockname(fd_.get(), reinterpret_cast<sockaddr*>(&address), &length) != 0) fail("notify socket: getsockname");
  address_.assign(address.sun_path, length - offsetof(sockaddr_un, sun_path));
  address_.front() = '@';  // how NOTIFY_SOCKET writes the zero byte that begins an abstract name
}

std::optional<Notification> NotifySocket::receive(pid_t sender) {
  while (true) {
    std::array<char, kMaxDatagram> text;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled by recvmsg
    iovec part{text.data(), text.size()};
    // Room for the credentials only: descriptors that a sender attaches (FDSTORE, BARRIER) are closed by the kernel.
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(ucred))> control{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(fd_.get(), &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return std::nullopt;

    const cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (header == nullptr || header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_CREDENTIALS) continue;
    ucred credentials{};
    std::memcpy(&credentials, CMSG_DATA(header), sizeof credentials);
    if (credentials.pid != sender) continue;
    return parse_notification({text.data(), static_cast<std::size_t>(size)});
  }
}

}  // namespace breakshot::launcher
