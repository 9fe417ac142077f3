#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace breakshot::bench {

/// The one JSON object that every benchmark writes (design.md section 7).
nlohmann::json report(const std::string& bench, const nlohmann::json& args, const nlohmann::json& metrics,
                      const nlohmann::json& goals = nlohmann::json::object());

/// Processor, cores, kernel and load of the machine that measured.
nlohmann::json machine();

/// Writes to a file; says where on standard output. @throws std::runtime_error when it cannot be written
void write_file(const std::string& file, const std::string& text);

}  // namespace breakshot::bench
