#pragma once

#include "common/process/process.hpp"

namespace breakshot::planner {

/// The planner's process: takes tasks, scenes and stroke statuses from DDS, runs the task, and says what it does. Returns when the process
/// is to stop.
void run_planner(process::Process& process);

}  // namespace breakshot::planner
