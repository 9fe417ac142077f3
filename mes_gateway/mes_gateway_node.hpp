#pragma once

#include "common/process/process.hpp"

namespace breakshot::mes {

/// Joins the factory's and the cell's domain and runs the order desk between them until the process is to stop.
void run_gateway(process::Process& process);

}  // namespace breakshot::mes
