#include "common/process/health_publisher.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <condition_variable>
#include <fstream>
#include <mutex>

namespace breakshot::process {

namespace {

constexpr Duration kPeriod = std::chrono::milliseconds{100};

double cpu_seconds() noexcept {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::uint64_t resident_bytes() {
  std::ifstream statm{"/proc/self/statm"};
  std::uint64_t total = 0;
  std::uint64_t resident = 0;
  statm >> total >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

HealthPublisher::HealthPublisher(Process& process, dds::Participant& participant, Report report)
    : process_{process},
      report_{std::move(report)},
      writer_{participant},
      started_{monotonic_now()},
      thread_{[this](const std::stop_token& stop) { run(stop); }} {}

HealthPublisher::~HealthPublisher() = default;

void HealthPublisher::run(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  while (!stop.stop_requested()) {
    Health health;
    health.process = process_.name();
    health.session = process_.session();
    health.pid = static_cast<std::uint64_t>(getpid());
    health.stamp = monotonic_now();
    health.uptime = health.stamp - started_;
    health.cpu_s = cpu_seconds();
    health.rss_bytes = resident_bytes();
    if (report_(health)) process_.alive();
    writer_.write(health);
    std::unique_lock lock{mutex};
    wake.wait_for(lock, stop, kPeriod, [] { return false; });
  }
}

}  // namespace breakshot::process
