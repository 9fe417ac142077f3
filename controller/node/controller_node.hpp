#pragma once

#include "common/process/process.hpp"

namespace breakshot::control {

/// Joins the cell and runs the control loop between strokes and drives until the process is to stop; then stops the arm on its path.
///
/// Threads: the loop (real-time); the command sender; the planning thread; the repetition of the stroke status; health. DDS threads only fill
/// slots and queues.
/// @throws process::RoleTaken when somebody else already commands the drives
/// @throws ConfigError, ArmDescriptionError, std::exception for what keeps it from starting
void run_controller(process::Process& process);

}  // namespace breakshot::control
