#pragma once

#include "common/time.hpp"

#include <filesystem>

namespace breakshot::launcher {

/// Tells the launcher of this run directory to take its cell down, and waits until it has. Prints what it does.
/// @return 0 when nothing runs (any more), 1 when the launcher had to be killed
int stop_cell(const std::filesystem::path& run_directory, Duration patience);

/// Prints each process of the cell with its state, CPU share and memory.
/// @return 0 when the cell is up and every process READY, 3 when it is down (as systemctl does), 1 otherwise
int show_cell(const std::filesystem::path& run_directory);

}  // namespace breakshot::launcher
