#include "common/health.hpp"

namespace breakshot {

const char* to_string(HealthState state) noexcept {
  switch (state) {
    case HealthState::kStarting: return "starting";
    case HealthState::kReady: return "ready";
    case HealthState::kDegraded: return "degraded";
    case HealthState::kStopped: return "stopped";
    case HealthState::kFault: return "fault";
  }
  return "invalid";
}

}  // namespace breakshot
