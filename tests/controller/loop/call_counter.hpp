#pragma once

#include <cstdint>

namespace breakshot::control::test {

/// Calls that have no place on the real-time thread.
struct CallCounts {
  std::uint64_t heap = 0;     ///< malloc, calloc, realloc, free and their aligned kin; operator new and delete end there
  std::uint64_t mutexes = 0;  ///< pthread_mutex_lock, _trylock and _unlock
};

/// Counts what the calling thread does between start() and stop(). This file's object replaces the functions for the whole program.
void start_counting() noexcept;
CallCounts stop_counting() noexcept;
/// False under sanitizers, which replace the same functions.
bool counting_works() noexcept;

}  // namespace breakshot::control::test
