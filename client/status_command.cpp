#include "client/status_command.hpp"

#include "common/dds/cell_topics.hpp"
#include "common/dds/endpoint.hpp"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>

namespace breakshot::client {

namespace {

constexpr int kNothingHeard = 3;

nlohmann::json to_json(const LoopTail& tail) {
  return {
      {"p50_us", tail.p50_us}, {"p99_us", tail.p99_us}, {"p999_us", tail.p999_us}, {"p9999_us", tail.p9999_us}, {"max_us", tail.max_us}};
}

nlohmann::json to_json(const Health& h) {
  return {{"state", to_string(h.state)},
          {"text", h.text},
          {"pid", h.pid},
          {"uptime_s", to_seconds(h.uptime)},
          {"cpu_s", h.cpu_s},
          {"rss_mib", static_cast<double>(h.rss_bytes) / 1048576.0},
          {"loop_hz", h.loop_hz},
          {"cycles", h.cycles},
          {"overruns", h.overruns},
          {"overruns_ours", h.overruns_ours},
          {"overruns_hosts", h.overruns_hosts},
          {"wakeup", to_json(h.wakeup)},
          {"compute", to_json(h.compute)},
          {"dropped", h.dropped}};
}

std::string text_of(const LoopTail& tail) {
  return fmt::format("{:.0f}/{:.0f}/{:.0f}/{:.0f}/{:.0f}", tail.p50_us, tail.p99_us, tail.p999_us, tail.p9999_us, tail.max_us);
}

void print(const std::map<std::string, Health>& processes) {
  fmt::print("{:<14}{:<10}{:>8}{:>10}{:>8}{:>8}{:>9}{:>10}{:>11}{:>9}  {}\n", "process", "state", "pid", "up s", "cpu %", "MiB", "loop Hz",
             "overruns", "wake p99", "dropped", "says");
  for (const auto& [name, h] : processes) {
    const double up = to_seconds(h.uptime);
    fmt::print("{:<14}{:<10}{:>8}{:>10.1f}{:>8.1f}{:>8.1f}{:>9.1f}{:>10}{:>8.0f} us{:>9}  {}\n", name, to_string(h.state), h.pid, up,
               up > 0.0 ? 100.0 * h.cpu_s / up : 0.0, static_cast<double>(h.rss_bytes) / 1048576.0, h.loop_hz, h.overruns, h.wakeup.p99_us,
               h.dropped, h.text);
    if (h.wakeup.p9999_us > 0.0) {
      fmt::print("{:<14}wake-up {}, tick {} us (p50/p99/p99.9/p99.99/max); overruns: {} ours, {} the host's\n", "", text_of(h.wakeup),
                 text_of(h.compute), h.overruns_ours, h.overruns_hosts);
    }
  }
}

}  // namespace

int run_status(int cell_domain, OrderClient& client, Duration listen, bool json) {
  dds::Participant participant{cell_domain, "breakshot-status"};
  dds::Reader<Health> healths{participant};
  std::map<std::string, Health> processes;
  const auto until = std::chrono::steady_clock::now() + listen;
  Health health;
  while (healths.take(health, until - std::chrono::steady_clock::now())) processes[health.process] = health;
  const auto robot = client.next_status(std::chrono::milliseconds{500});

  if (json) {
    nlohmann::json out;
    for (const auto& [name, h] : processes) out["processes"][name] = to_json(h);
    if (robot) out["mes"] = {{"state", mes::to_string(robot->state)}, {"accepting", robot->accepting}, {"paused", robot->paused}};
    fmt::print("{}\n", out.dump(2));
  } else if (processes.empty() && !robot) {
    fmt::print("nothing heard on cell domain {}: the cell is down (./breakshot up starts it)\n", cell_domain);
  } else {
    print(processes);
    if (robot)
      fmt::print("\nfactory side: {}, {}\n", mes::to_string(robot->state), robot->accepting ? "takes orders" : "takes no order now");
  }
  if (processes.empty()) return kNothingHeard;
  return std::all_of(processes.begin(), processes.end(), [](const auto& p) { return p.second.state == HealthState::kReady; }) ? 0 : 1;
}

}  // namespace breakshot::client
