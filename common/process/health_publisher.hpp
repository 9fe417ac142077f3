#pragma once

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"
#include "common/health.hpp"
#include "common/process/process.hpp"

#include <functional>
#include <thread>

namespace breakshot::process {

/// Publishes `cell/health` at 10 Hz from a thread of its own and feeds the watchdog as long as the process makes progress.
///
/// Process number, session, uptime, CPU time and memory are filled in here; `report` adds state, text and figures. It also returns whether
/// the main cycle advanced since the last call, because a watchdog that is fed by a bystander watches nothing.
class HealthPublisher {
 public:
  /// Fills in what only the process knows. @return true when the process's main cycle went on since the last call (or has nothing to do)
  using Report = std::function<bool(Health&)>;

  HealthPublisher(Process& process, dds::Participant& participant, Report report);
  ~HealthPublisher();
  HealthPublisher(const HealthPublisher&) = delete;
  HealthPublisher& operator=(const HealthPublisher&) = delete;
  HealthPublisher(HealthPublisher&&) = delete;
  HealthPublisher& operator=(HealthPublisher&&) = delete;

 private:
  void run(const std::stop_token& stop);

  Process& process_;
  Report report_;
  dds::Writer<Health> writer_;
  Time started_;
  std::jthread thread_;
};

}  // namespace breakshot::process
