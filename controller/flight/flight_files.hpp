#pragma once

#include "common/result.hpp"
#include "controller/flight/flight_record.hpp"

#include <filesystem>
#include <string>

namespace breakshot::control::flight {

/// Writes a record into a folder, which is made if need be, and removes the oldest of the same trigger beyond `keep`.
///
/// A crash or a power cut leaves the whole file or none: it is written under another name, synced, and renamed. Blocks for as long as the disk takes.
/// @param keep  at least 1
/// @return the file's path: flight-UTC-TRIGGER.flight; or what went wrong
Result<std::filesystem::path, std::string> store(const std::filesystem::path& folder, const FlightRecord& record, std::size_t keep);

/// Reads a record. @return it, or what is wrong with the file, without its name
Result<FlightRecord, std::string> load(const std::filesystem::path& file);

}  // namespace breakshot::control::flight
