#pragma once

#include "common/process/process.hpp"

namespace breakshot::perception {

/// The process of perception: takes camera frames from DDS and publishes the scene of each. Returns when the process is to stop.
/// @throws process::ProcessError when the camera announces another calibration than the file that this process works with
void run_perception(process::Process& process);

}  // namespace breakshot::perception
