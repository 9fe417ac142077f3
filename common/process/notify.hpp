#pragma once

#include "common/time.hpp"

#include <optional>
#include <string>

namespace breakshot::process {

// The sd_notify protocol, spoken to systemd or to breakshot-launch alike; silent when neither started us. Never from a real-time thread.

/// The process does its work from now on.
void notify_ready(const std::string& status);
void notify_status(const std::string& status);
void notify_stopping(const std::string& status);
/// To be called at least every half of watchdog_period(), and only while the process really does its work.
void notify_alive();
/// How long the process may stay silent before it is killed and restarted; nothing when nobody watches.
std::optional<Duration> watchdog_period();

}  // namespace breakshot::process
