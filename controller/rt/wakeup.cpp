#include "controller/rt/wakeup.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <ctime>
#include <system_error>

namespace breakshot::rt {

WakeupSignal::WakeupSignal() : fd_{eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)} {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

WakeupSignal::~WakeupSignal() { close(fd_); }

void WakeupSignal::notify() noexcept {
  const std::uint64_t one = 1;
  // Fails only when 2^64 - 2 signals wait, and then the other side is awake anyway.
  [[maybe_unused]] const auto written = ::write(fd_, &one, sizeof one);
}

bool WakeupSignal::wait(Duration timeout) noexcept {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  pollfd event{fd_, POLLIN, 0};
  const timespec limit{timeout.count() / kNsPerSecond, timeout.count() % kNsPerSecond};
  if (ppoll(&event, 1, &limit, nullptr) <= 0) return false;
  std::uint64_t count = 0;
  return ::read(fd_, &count, sizeof count) == sizeof count;
}

}  // namespace breakshot::rt
