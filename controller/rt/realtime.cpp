#include "controller/rt/realtime.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <system_error>

namespace breakshot::rt {

namespace {

/// Writes one byte per page, so that each is mapped before it is needed.
void touch(volatile unsigned char* memory, std::size_t bytes) noexcept {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  for (std::size_t i = 0; i < bytes; i += page) memory[i] = 0;
}

[[gnu::noinline]] void touch_stack(std::size_t bytes) noexcept {
  // alloca: a fixed array would fault in its size for every setting.
  touch(static_cast<volatile unsigned char*>(__builtin_alloca(bytes)), bytes);
}

std::size_t stack_size_of_this_thread() noexcept {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  std::size_t bytes = 0;
  pthread_attr_getstacksize(&attributes, &bytes);
  pthread_attr_destroy(&attributes);
  return bytes;
}

std::string failed(const std::string& what, int error) { return what + ": " + std::system_category().message(error); }

}  // namespace

std::vector<MissingGuarantee> lock_memory(const RealtimeSettings& settings) {
  std::vector<MissingGuarantee> missing;
  // Memory that was freed stays ours, and big blocks come from the heap that is touched below instead of fresh, unmapped pages (the recipe is LinuxCNC's).
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_MMAP_MAX, 0);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    const int error = errno;
    rlimit limit{};
    getrlimit(RLIMIT_MEMLOCK, &limit);
    missing.push_back(
        {failed("mlockall", error) + " (RLIMIT_MEMLOCK is " + std::to_string(limit.rlim_cur / 1024) + " KiB)",
         "pages may be swapped out or mapped late, which costs the loop up to milliseconds",
         "systemd unit: LimitMEMLOCK=infinity; by hand: `ulimit -l unlimited` as root, or a line \"USER - memlock unlimited\" in "
         "/etc/security/limits.d/breakshot.conf, or capability CAP_IPC_LOCK"});
  }
  if (settings.heap_bytes > 0) {
    const std::unique_ptr<unsigned char, decltype(&std::free)> block{static_cast<unsigned char*>(std::malloc(settings.heap_bytes)),
                                                                     &std::free};
    if (block) touch(block.get(), settings.heap_bytes);
  }
  return missing;
}

std::vector<MissingGuarantee> make_thread_realtime(const RealtimeSettings& settings) {
  std::vector<MissingGuarantee> missing;

  const sched_param wanted{settings.priority};
  int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  if (error == 0) {
    int policy = SCHED_OTHER;
    sched_param got{};
    error = pthread_getschedparam(pthread_self(), &policy, &got);
    if (error == 0 && (policy != SCHED_FIFO || got.sched_priority != settings.priority)) error = EPERM;
  }
  if (error != 0) {
    missing.push_back({failed("SCHED_FIFO priority " + std::to_string(settings.priority), error),
                       "any other process may delay the loop by milliseconds",
                       "systemd unit: LimitRTPRIO=90; by hand: run as root, or a line \"USER - rtprio 90\" in "
                       "/etc/security/limits.d/breakshot.conf, or capability "
                       "CAP_SYS_NICE; in a container also its real-time budget (docker: --ulimit rtprio=90 --cap-add SYS_NICE)"});
  }

  if (settings.cpu >= 0) {
    error = EINVAL;
    if (settings.cpu < CPU_SETSIZE) {
      cpu_set_t set;
      CPU_ZERO(&set);
      CPU_SET(static_cast<std::size_t>(settings.cpu), &set);
      error = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    }
    if (error != 0) {
      missing.push_back({failed("core " + std::to_string(settings.cpu), error), "the loop may move between cores and find cold caches",
                         "choose a core that this process may use (`taskset -p PID` shows them), or -1 for any"});
    }
  }

  // Leave room for what already lies on the stack.
  constexpr std::size_t kReserve = 64 * 1024;
  const std::size_t stack = stack_size_of_this_thread();
  if (stack > kReserve) touch_stack(std::min(settings.stack_bytes, stack - kReserve));
  return missing;
}

WakeLatencyLimit::WakeLatencyLimit(std::optional<int> limit_us) {
  if (!limit_us) return;
  // The request holds for as long as the file is open (Documentation/power/pm_qos_interface.rst).
  file_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t limit = *limit_us;
  if (file_ >= 0 && write(file_, &limit, sizeof limit) == sizeof limit) return;
  missing_.push_back(
      {failed("/dev/cpu_dma_latency at " + std::to_string(limit) + " us", errno),
       "cores sleep as deeply as they like, and the loop wakes later by what that costs: microseconds to tens of them",
       "let this user write the device (`chgrp breakshot /dev/cpu_dma_latency && chmod g+w /dev/cpu_dma_latency`; the systemd unit "
       "does), or set controller.realtime.wake_latency_us to -1"});
}

WakeLatencyLimit::~WakeLatencyLimit() {
  if (file_ >= 0) close(file_);
}

}  // namespace breakshot::rt
