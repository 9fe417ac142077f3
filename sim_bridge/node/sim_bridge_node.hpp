#pragma once

#include "common/process/process.hpp"

namespace breakshot::sim_bridge {

/// Joins the cell and runs the simulated arm, table and camera until the process is to stop.
///
/// Threads: physics (SCHED_FIFO in real-time mode; in lockstep mode it waits for commands); the camera; the sender of states (real-time mode); the
/// reader of `sim/control`; health. DDS threads only fill mailboxes.
/// @throws ConfigError, ArmDescriptionError, CameraError, std::exception for what keeps it from starting
void run_sim_bridge(process::Process& process);

}  // namespace breakshot::sim_bridge
