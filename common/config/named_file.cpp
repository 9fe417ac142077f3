#include "common/config/named_file.hpp"

#include "common/config/config_value.hpp"

#include <algorithm>

namespace breakshot {
namespace {

constexpr std::size_t kMostQuoted = 80;  // characters of a name in an error

std::string lower_case(std::string_view text) {
  std::string lower{text};
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

}  // namespace

std::vector<std::string> file_names(const std::filesystem::path& folder, std::string_view kind) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator{folder, error}) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  if (error) {
    detail::throw_config_error(folder.string(), "", "a folder that cannot be read: " + error.message(),
                               "a folder of files for each " + std::string{kind});
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::filesystem::path named_file(const std::filesystem::path& folder, std::string_view kind, std::string_view name,
                                 std::string_view or_else) {
  const std::vector<std::string> names = file_names(folder, kind);
  const auto found =
      std::find_if(names.begin(), names.end(), [&](const std::string& each) { return lower_case(each) == lower_case(name); });
  if (found != names.end()) return folder / (*found + ".yaml");
  const std::string_view quoted = name.substr(0, kMostQuoted);
  detail::throw_config_error(std::string{kind} + " \"" + std::string{quoted} + "\"", "", "no such file in " + folder.string(),
                             detail::list_names(names, quoted) + std::string{or_else});
}

}  // namespace breakshot
