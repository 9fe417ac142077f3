#pragma once

#include <filesystem>
#include <functional>

namespace breakshot::launcher {

/// Runs `body` in a process of its own, without a terminal, and returns when it says that it is ready or has ended.
///
/// Until then its output is shown here, and Ctrl-C here stops it; afterwards its output goes to `log_file`. To be called before any thread exists.
/// @param body  gets the function that says "ready", and returns its exit status
/// @return 0 once it is ready, else its exit status
/// @throws std::system_error when the kernel gives no process or pipe
int run_in_background(const std::filesystem::path& log_file, const std::function<int(const std::function<void()>& ready)>& body);

}  // namespace breakshot::launcher
