#pragma once

namespace breakshot::process {

/// Exit statuses of the cell's processes (sysexits.h where it has one). Nobody restarts after kExitUsage, kExitRoleTaken or kExitConfig: the
/// process would only fail again.
inline constexpr int kExitOk = 0;
inline constexpr int kExitFailure = 1;
inline constexpr int kExitUsage = 64;
inline constexpr int kExitRoleTaken = 73;
inline constexpr int kExitConfig = 78;

}  // namespace breakshot::process
