#include "tests/controller/loop/syscall_watch.hpp"

#include <sys/prctl.h>

#include <csignal>

#if defined(__x86_64__) && defined(PR_SET_SYSCALL_USER_DISPATCH) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include <ucontext.h>
#define BREAKSHOT_WATCHES_SYSCALLS 1
#endif

namespace breakshot::control::test {

#ifdef BREAKSHOT_WATCHES_SYSCALLS

namespace {

// Written from a signal handler of the same thread: volatile is what that takes.
thread_local volatile char selector = SYSCALL_DISPATCH_FILTER_ALLOW;
thread_local SyscallCounts counts;

long carry_out(greg_t* registers) noexcept {
  long result = registers[REG_RAX];
  register long r10 asm("r10") = registers[REG_R10];
  register long r8 asm("r8") = registers[REG_R8];
  register long r9 asm("r9") = registers[REG_R9];
  asm volatile("syscall"
               : "+a"(result)
               : "D"(registers[REG_RDI]), "S"(registers[REG_RSI]), "d"(registers[REG_RDX]), "r"(r10), "r"(r8), "r"(r9)
               : "rcx", "r11", "memory");
  return result;
}

void on_call(int /*signal*/, siginfo_t* info, void* context) {
  // Lets this handler's own return through, and whatever else the span calls.
  selector = SYSCALL_DISPATCH_FILTER_ALLOW;
  if (counts.calls++ == 0) counts.first = info->si_syscall;
  greg_t* registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  registers[REG_RAX] = carry_out(registers);
}

}  // namespace

bool watch_syscalls() noexcept {
  struct sigaction action {};
  action.sa_sigaction = on_call;
  action.sa_flags = SA_SIGINFO;
  counts = {};
  return sigaction(SIGSYS, &action, nullptr) == 0 && prctl(PR_SET_SYSCALL_USER_DISPATCH, PR_SYS_DISPATCH_ON, 0UL, 0UL, &selector) == 0;
}

void begin_span() noexcept { selector = SYSCALL_DISPATCH_FILTER_BLOCK; }
void end_span() noexcept { selector = SYSCALL_DISPATCH_FILTER_ALLOW; }
SyscallCounts syscall_counts() noexcept { return counts; }

#else

bool watch_syscalls() noexcept { return false; }
void begin_span() noexcept {}
void end_span() noexcept {}
SyscallCounts syscall_counts() noexcept { return {}; }

#endif

}  // namespace breakshot::control::test
