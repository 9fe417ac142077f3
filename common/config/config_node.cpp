#include "common/config/config_node.hpp"

#include "common/config/config_value.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

namespace breakshot {
namespace {

using detail::ConfigValue;
using detail::throw_config_error;
using Kind = ConfigValue::Kind;

[[noreturn]] void refuse_value(const ConfigValue& value, std::string_view allowed) {
  throw_config_error(value.place, value.key, value.describe(), allowed);
}

/// Shortest text that reads back as the same number.
std::string to_text(double number) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number);
  return error == std::errc{} ? std::string{buffer.data(), end} : std::string{"?"};
}

std::string describe(Range range, std::string_view unit) {
  const bool has_lo = range.lo > Range{}.lo;
  const bool has_hi = range.hi < Range{}.hi;
  std::string text = "a number";
  if (has_lo && has_hi) {
    text += " in [" + to_text(range.lo) + ", " + to_text(range.hi) + "]";
  } else if (has_lo) {
    text += " >= " + to_text(range.lo);
  } else if (has_hi) {
    text += " <= " + to_text(range.hi);
  }
  if (!unit.empty()) text.append(" ").append(unit);
  return text;
}

/// The whole of a plain scalar as a number of type T; nothing when it is not one.
template <typename T>
std::optional<T> parse_number(const ConfigValue& value) {
  if (value.kind != Kind::kScalar || value.quoted) return std::nullopt;
  T number{};
  const char* const end = value.scalar.data() + value.scalar.size();
  const auto [stop, error] = std::from_chars(value.scalar.data(), end, number);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return number;
}

double read_number(const ConfigValue& value, Range range, std::string_view unit) {
  const auto number = parse_number<double>(value);
  if (!number || !std::isfinite(*number) || *number < range.lo || *number > range.hi) refuse_value(value, describe(range, unit));
  return *number;
}

std::string read_text(const ConfigValue& value, std::string_view allowed) {
  if (value.kind != Kind::kScalar || value.scalar.empty()) refuse_value(value, allowed);
  return value.scalar;
}

const ConfigValue& must_be_map(const ConfigValue& value) {
  if (value.kind != Kind::kMap) refuse_value(value, "a map of keys");
  return value;
}

const std::vector<ConfigValue>& must_be_list(const ConfigValue& value, std::string_view allowed) {
  if (value.kind != Kind::kList) refuse_value(value, allowed);
  return value.items;
}

// Down into maps and lists of maps, so that a reader who forgets finish() on a child leaves no hole.
void refuse_unasked(const ConfigValue& value) {
  for (const ConfigValue& item : value.items) {
    if (value.kind == Kind::kMap && std::find(value.asked.begin(), value.asked.end(), item.name) == value.asked.end()) {
      throw_config_error(item.place, item.key, "an unknown key", detail::list_names(value.asked, item.name));
    }
    refuse_unasked(item);
  }
}

}  // namespace

const ConfigValue* ConfigNode::find(std::string_view key) const {
  auto& asked = value_->asked;
  if (std::find(asked.begin(), asked.end(), key) == asked.end()) asked.emplace_back(key);
  return value_->find(key);
}

const ConfigValue& ConfigNode::get(std::string_view key, std::string_view allowed) const {
  if (const ConfigValue* value = find(key)) return *value;
  const std::string dotted = value_->key.empty() ? std::string{key} : value_->key + "." + std::string{key};
  throw_config_error(value_->place, dotted, "no such key", allowed);
}

bool ConfigNode::has(std::string_view key) const { return find(key) != nullptr; }

double ConfigNode::number(std::string_view key, Range range, std::string_view unit) const {
  return read_number(get(key, describe(range, unit)), range, unit);
}

std::vector<double> ConfigNode::numbers(std::string_view key, std::size_t count, Range range, std::string_view unit) const {
  return numbers(key, count, count, range, unit);
}

std::vector<double> ConfigNode::numbers(std::string_view key, std::size_t min_count, std::size_t max_count, Range range,
                                        std::string_view unit) const {
  std::string allowed = "a list of " + std::to_string(min_count);
  if (max_count != min_count) allowed += " to " + std::to_string(max_count);
  allowed += ", each " + describe(range, unit);
  const ConfigValue& value = get(key, allowed);
  const auto& items = must_be_list(value, allowed);
  if (items.size() < min_count || items.size() > max_count) refuse_value(value, allowed);
  std::vector<double> numbers;
  numbers.reserve(items.size());
  for (const ConfigValue& item : items) numbers.push_back(read_number(item, range, unit));
  return numbers;
}

Vector2 ConfigNode::vector2(std::string_view key, Range range, std::string_view unit) const {
  const auto values = numbers(key, 2, range, unit);
  return {values[0], values[1]};
}

Vector3 ConfigNode::vector3(std::string_view key, Range range, std::string_view unit) const {
  const auto values = numbers(key, 3, range, unit);
  return {values[0], values[1], values[2]};
}

std::int64_t ConfigNode::integer(std::string_view key, std::int64_t lo, std::int64_t hi) const {
  const std::string allowed = "a whole number in [" + std::to_string(lo) + ", " + std::to_string(hi) + "]";
  const ConfigValue& value = get(key, allowed);
  const auto number = parse_number<std::int64_t>(value);
  if (!number || *number < lo || *number > hi) refuse_value(value, allowed);
  return *number;
}

bool ConfigNode::flag(std::string_view key) const {
  const ConfigValue& value = get(key, "true or false");
  if (value.kind == Kind::kScalar && !value.quoted && value.scalar == "true") return true;
  if (value.kind == Kind::kScalar && !value.quoted && value.scalar == "false") return false;
  refuse_value(value, "true or false");
}

std::string ConfigNode::text(std::string_view key) const { return read_text(get(key, "a text"), "a text"); }

std::vector<std::string> ConfigNode::texts(std::string_view key) const {
  std::vector<std::string> texts;
  for (const ConfigValue& item : must_be_list(get(key, "a list of texts"), "a list of texts")) texts.push_back(read_text(item, "a text"));
  return texts;
}

std::string ConfigNode::choice(std::string_view key, std::initializer_list<std::string_view> words) const {
  const std::vector<std::string> copies{words.begin(), words.end()};
  return choice(key, copies);
}

std::string ConfigNode::choice(std::string_view key, std::span<const std::string> words) const {
  const ConfigValue& value = get(key, detail::list_names(words));
  if (value.kind != Kind::kScalar || std::find(words.begin(), words.end(), value.scalar) == words.end()) {
    refuse_value(value, detail::list_names(words, value.scalar));
  }
  return value.scalar;
}

std::filesystem::path ConfigNode::path(std::string_view key) const {
  const std::filesystem::path path = read_text(get(key, "a path"), "a path");
  return path.is_absolute() ? path : (value_->folder / path).lexically_normal();
}

std::filesystem::path ConfigNode::file(std::string_view key) const {
  std::filesystem::path path = this->path(key);
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) refuse(key, path.string() + ", which is not there", "the path of a file");
  return path;
}

std::filesystem::path ConfigNode::folder(std::string_view key) const {
  std::filesystem::path path = this->path(key);
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) refuse(key, path.string() + ", which is not there", "the path of a folder");
  return path;
}

ConfigNode ConfigNode::child(std::string_view key) const { return ConfigNode{must_be_map(get(key, "a map of keys"))}; }

std::vector<ConfigNode> ConfigNode::items(std::string_view key) const {
  std::vector<ConfigNode> nodes;
  for (const ConfigValue& item : must_be_list(get(key, "a list of maps"), "a list of maps")) nodes.push_back(ConfigNode{must_be_map(item)});
  return nodes;
}

std::vector<std::string> ConfigNode::keys() const { return value_->keys(); }

void ConfigNode::finish() const { refuse_unasked(*value_); }

void ConfigNode::refuse(std::string_view key, std::string_view found, std::string_view allowed) const {
  const ConfigValue* value = key.empty() ? value_ : value_->find(key);
  if (value == nullptr) throw_config_error(value_->place, value_->key + "." + std::string{key}, found, allowed);
  throw_config_error(value->place, value->key, found, allowed);
}

}  // namespace breakshot
