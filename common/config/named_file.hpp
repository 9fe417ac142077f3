#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot {

// Formations and lighting presets are files of a folder, chosen by name: of `kind` "formation" the name F is the folder's F.yaml.

/// The names of a folder, sorted. @throws ConfigError when it cannot be read
std::vector<std::string> file_names(const std::filesystem::path& folder, std::string_view kind);

/// The file of a name, whatever the case of its letters.
/// @param or_else  what else the caller takes in place of a name, for the error
/// @throws ConfigError that lists the names when there is no such file
std::filesystem::path named_file(const std::filesystem::path& folder, std::string_view kind, std::string_view name,
                                 std::string_view or_else = "");

}  // namespace breakshot
