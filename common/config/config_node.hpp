#pragma once

#include "common/geometry.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot {

/// Something in a configuration is not as it must be. Says "file:line: dotted.key: found X; allowed Y"; for a value that came from the
/// command line, `--set` stands in the place of the file and line.
class ConfigError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A closed range of allowed numbers, lo <= hi. May be unbounded on a side; never lets NaN or an infinity through.
struct Range {
  double lo = -std::numeric_limits<double>::max();
  double hi = std::numeric_limits<double>::max();
};

namespace detail {
struct ConfigValue;
}  // namespace detail

/// A strict reader of one map of a configuration file.
///
/// Every read checks presence, type and range, and throws ConfigError with the place. What was read is remembered in the document, so
/// that finish() can refuse the keys that nobody asked for. A node is a light handle: the ConfigDocument must outlive it. Not thread-safe;
/// configuration is read before any thread starts.
class ConfigNode {
 public:
  /// Whether a key is there; the way to read a key that may be left out.
  bool has(std::string_view key) const;

  /// A finite number in the range. `unit` only explains ("m", "rad/s", "ms"; "" for a pure number).
  double number(std::string_view key, Range range, std::string_view unit) const;
  /// A list of exactly `count` numbers.
  std::vector<double> numbers(std::string_view key, std::size_t count, Range range, std::string_view unit) const;
  /// A list of `min_count` to `max_count` numbers.
  std::vector<double> numbers(std::string_view key, std::size_t min_count, std::size_t max_count, Range range, std::string_view unit) const;
  /// A list of two numbers, each in the range.
  Vector2 vector2(std::string_view key, Range range, std::string_view unit = "m") const;
  /// A list of three numbers, each in the range.
  Vector3 vector3(std::string_view key, Range range, std::string_view unit = "m") const;
  /// A whole number, written without a fraction or an exponent.
  std::int64_t integer(std::string_view key, std::int64_t lo, std::int64_t hi) const;
  /// `true` or `false`; no other spelling.
  bool flag(std::string_view key) const;
  /// A text that is not empty.
  std::string text(std::string_view key) const;
  /// A list of texts that are not empty; the list may be.
  std::vector<std::string> texts(std::string_view key) const;
  /// One of the given words.
  std::string choice(std::string_view key, std::initializer_list<std::string_view> words) const;
  std::string choice(std::string_view key, std::span<const std::string> words) const;

  /// A path; a relative one counts from the folder of the configuration file. Need not exist.
  std::filesystem::path path(std::string_view key) const;
  /// The path of a file that exists.
  std::filesystem::path file(std::string_view key) const;
  /// The path of a folder that exists.
  std::filesystem::path folder(std::string_view key) const;

  /// The map under a key.
  ConfigNode child(std::string_view key) const;
  /// The maps in the list under a key, in order.
  std::vector<ConfigNode> items(std::string_view key) const;
  /// The keys of this map, as they stand in the file.
  std::vector<std::string> keys() const;

  /// Throws for any key here, or in a map below that was read, that nobody asked for. Call it when a section is read.
  void finish() const;

  /// For checks across keys: throws ConfigError at the place of `key` (of this map itself when `key` is empty).
  [[noreturn]] void refuse(std::string_view key, std::string_view found, std::string_view allowed) const;

 private:
  friend class ConfigDocument;
  explicit ConfigNode(const detail::ConfigValue& value) noexcept : value_{&value} {}

  const detail::ConfigValue& get(std::string_view key, std::string_view allowed) const;
  const detail::ConfigValue* find(std::string_view key) const;

  const detail::ConfigValue* value_;
};

/// A configuration file, read whole, with the overrides of the command line applied.
///
/// YAML without its surprises: one document, no anchors, aliases or tags, no duplicate keys, at most 16 levels deep, at most 4 MiB.
class ConfigDocument {
 public:
  /// Reads a file.
  ///
  /// @param overrides  each "a.b.c=value" as given to `--set`: replaces the value of a key that is in the file by a YAML value; of two for
  ///                   one key the later counts. A key of a list's item is not reachable: replace the list.
  /// @throws ConfigError when the file cannot be read, is not such YAML, or an override is malformed or names an unknown key
  static ConfigDocument load(const std::filesystem::path& file, std::span<const std::string> overrides = {});
  /// As load(), from a text; `name` stands for the file in errors, and its folder is what relative paths count from.
  static ConfigDocument parse(std::string_view text, const std::filesystem::path& name, std::span<const std::string> overrides = {});

  ConfigDocument(ConfigDocument&&) noexcept;
  ConfigDocument& operator=(ConfigDocument&&) noexcept;
  ~ConfigDocument();

  /// The whole document; for files that have no sections.
  ConfigNode root() const& noexcept;
  /// A top-level map. @throws ConfigError when it is missing
  ConfigNode section(std::string_view name) const&;
  ConfigNode root() const&& = delete;  ///< the node would dangle
  ConfigNode section(std::string_view name) const&& = delete;

  /// Throws for a top-level key that is not among the given sections.
  void only_sections(std::span<const std::string_view> names) const;

 private:
  explicit ConfigDocument(std::unique_ptr<const detail::ConfigValue> root) noexcept;

  std::unique_ptr<const detail::ConfigValue> root_;
};

}  // namespace breakshot
