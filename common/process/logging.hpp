#pragma once

#include <string>

namespace breakshot::process {

/// Makes spdlog's default logger asynchronous, to standard error, one line per record with UTC time, level and process name.
///
/// Under systemd the time is left out, since the journal has its own. Messages are structured: `code=... key=value`. Never log from the
/// real-time thread.
/// @param level  trace, debug, info, warning, error or off
/// @throws std::invalid_argument for another level
void start_logging(const std::string& process, const std::string& level);

/// Writes out all that is queued. Call before exit.
void stop_logging() noexcept;

}  // namespace breakshot::process
