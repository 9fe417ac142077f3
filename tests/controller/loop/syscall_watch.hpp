#pragma once

#include <cstdint>

namespace breakshot::control::test {

/// What stop_watching_syscalls() found.
struct SyscallCounts {
  std::uint64_t calls = 0;  ///< watched spans that made at least one
  long first = -1;          ///< number of the first one ever; -1: none
};

/// Prepares the calling thread. @return false when the kernel or the processor cannot do it: Linux 5.11 on x86-64 and no sanitizer are needed
bool watch_syscalls() noexcept;
/// From here on a system call of the calling thread is counted (once per span), and still carried out. The kernel sees to that by Syscall User
/// Dispatch: a byte in memory says whether calls pass or raise SIGSYS, so that beginning and ending a span costs one store each.
void begin_span() noexcept;
void end_span() noexcept;
/// Of the calling thread, since watch_syscalls().
SyscallCounts syscall_counts() noexcept;

}  // namespace breakshot::control::test
