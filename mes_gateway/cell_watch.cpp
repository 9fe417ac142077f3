#include "mes_gateway/cell_watch.hpp"

#include <fmt/core.h>

namespace breakshot::mes {

void CellWatch::on_health(const Health& health, Time now) { heard_.insert_or_assign(health.process, Heard{health, now}); }

std::string CellWatch::what_is_missing(Time now) const {
  for (const auto& process : needed_) {
    const auto known = heard_.find(process);
    if (known == heard_.end()) return process + " has not been heard yet";
    const auto silent = now - known->second.when;
    if (silent > silent_after_) return fmt::format("{} has been silent for {:.1f} s", process, to_seconds(silent));
    const Health& health = known->second.health;
    if (health.state != HealthState::kReady) return fmt::format("{} is {}: {}", process, to_string(health.state), health.text);
  }
  return {};
}

std::string CellWatch::what_stopped(const std::string& process, Time now) const {
  const auto known = heard_.find(process);
  if (known == heard_.end() || now - known->second.when > silent_after_ || known->second.health.state != HealthState::kStopped) return {};
  return known->second.health.text;
}

const Health* CellWatch::of(const std::string& process) const {
  const auto known = heard_.find(process);
  return known == heard_.end() ? nullptr : &known->second.health;
}

}  // namespace breakshot::mes
