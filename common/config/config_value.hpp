#pragma once

// Private to common/config: the tree behind ConfigNode, and its reader. Nothing outside this folder includes it.

#include "common/config/config_node.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot::detail {

/// A value of a configuration with the place that it came from.
struct ConfigValue {
  enum class Kind { kNothing, kScalar, kList, kMap };

  Kind kind = Kind::kNothing;
  std::string scalar;              ///< kScalar
  bool quoted = false;             ///< kScalar: written in quotes, so a text and never a number or a flag
  std::string name;                ///< in a map: its key there
  std::vector<ConfigValue> items;  ///< kList: its items; kMap: its entries, in the order of the file
  std::string place;               ///< "file:line" or "--set"
  std::string key;                 ///< dotted from the root; "" for the root
  std::filesystem::path folder;    ///< what relative paths count from
  /// kMap: keys that a reader asked for, in order. Bookkeeping for finish(), not part of the value.
  mutable std::vector<std::string> asked;

  /// The entry of a map; nullptr when it is not there, or this is no map.
  const ConfigValue* find(std::string_view wanted) const;
  ConfigValue* find(std::string_view wanted);
  std::vector<std::string> keys() const;
  /// For people, cut to a line: `0.3`, "a list of 3", "a map", "nothing".
  std::string describe() const;
};

/// Where a text that is being parsed came from.
struct ConfigOrigin {
  std::string name;       ///< file, or "--set"
  bool has_lines = true;  ///< a place is "name:line", else just "name"
  std::string key;        ///< dotted key that the whole text stands under; "" for a document
  std::filesystem::path folder;
};

/// Parses one YAML document. @throws ConfigError
ConfigValue parse_config(std::string_view text, const ConfigOrigin& origin);

/// "`place`: `key`: found `found`; allowed: `allowed`"; a root's empty key is left out.
[[noreturn]] void throw_config_error(const std::string& place, const std::string& key, std::string_view found, std::string_view allowed);

/// "a, b, c"; "nothing" for an empty list. With `wanted`, the nearest name is offered: "a, b, c (did you mean b?)".
std::string list_names(std::span<const std::string> names, std::string_view wanted = {});

}  // namespace breakshot::detail
