#include "common/config/config_node.hpp"
#include "common/config/config_value.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

namespace breakshot {
namespace {

using detail::ConfigOrigin;
using detail::ConfigValue;
using detail::throw_config_error;

constexpr std::size_t kMaxFileSize = 4U << 20U;  // bytes; the shipped cell.yaml has about 20 kB
const std::string kOverridePlace = "--set";

/// Replaces the value that "a.b.c=value" names.
void apply_override(ConfigValue& root, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw_config_error(kOverridePlace, "", "\"" + text + "\"", "section.key=value");
  }
  const std::string key = text.substr(0, equals);
  ConfigValue* target = &root;
  for (std::size_t begin = 0; begin <= key.size();) {
    const std::size_t end = std::min(key.find('.', begin), key.size());
    const std::string name = key.substr(begin, end - begin);
    if (target->kind != ConfigValue::Kind::kMap) {
      throw_config_error(kOverridePlace, key, target->key + ", which holds " + target->describe(),
                         "a key of a map; a list or a value is replaced whole");
    }
    ConfigValue* next = target->find(name);
    if (next == nullptr) {
      throw_config_error(kOverridePlace, key, "an unknown key", detail::list_names(target->keys(), name));
    }
    target = next;
    begin = end + 1;
  }
  // To the YAML parser an empty text is no document at all, which would give an error about YAML.
  const std::string value = text.substr(equals + 1);
  if (value.find_first_not_of(" \t") == std::string::npos) throw_config_error(kOverridePlace, key, "nothing", "a value after the =");
  std::string target_name = std::move(target->name);
  *target = detail::parse_config(value, ConfigOrigin{kOverridePlace, false, key, root.folder});
  target->name = std::move(target_name);
}

}  // namespace

ConfigDocument::ConfigDocument(std::unique_ptr<const ConfigValue> root) noexcept : root_{std::move(root)} {}
ConfigDocument::ConfigDocument(ConfigDocument&&) noexcept = default;
ConfigDocument& ConfigDocument::operator=(ConfigDocument&&) noexcept = default;
ConfigDocument::~ConfigDocument() = default;

ConfigDocument ConfigDocument::load(const std::filesystem::path& file, std::span<const std::string> overrides) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) throw_config_error(file.string(), "", "no such file", "a readable YAML file");
  std::ifstream stream{file, std::ios::binary};
  if (!stream)
    throw_config_error(file.string(), "", "a file that cannot be opened: " + std::generic_category().message(errno), "a readable file");
  std::string text;
  text.resize(kMaxFileSize + 1);
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (stream.bad()) throw_config_error(file.string(), "", "a file that cannot be read", "a readable file");
  if (text.size() > kMaxFileSize) throw_config_error(file.string(), "", "a file of more than 4 MiB", "a smaller file");
  return parse(text, file, overrides);
}

ConfigDocument ConfigDocument::parse(std::string_view text, const std::filesystem::path& name, std::span<const std::string> overrides) {
  auto root = std::make_unique<ConfigValue>(detail::parse_config(text, ConfigOrigin{name.string(), true, "", name.parent_path()}));
  if (root->kind != ConfigValue::Kind::kMap) throw_config_error(root->place, "", root->describe(), "a map of keys");
  for (const std::string& text_of_override : overrides) apply_override(*root, text_of_override);
  return ConfigDocument{std::move(root)};
}

ConfigNode ConfigDocument::root() const& noexcept { return ConfigNode{*root_}; }

ConfigNode ConfigDocument::section(std::string_view name) const& { return root().child(name); }

void ConfigDocument::only_sections(std::span<const std::string_view> names) const {
  for (const ConfigValue& section : root_->items) {
    if (std::find(names.begin(), names.end(), section.name) != names.end()) continue;
    const std::vector<std::string> copies{names.begin(), names.end()};
    throw_config_error(section.place, section.key, "an unknown section", detail::list_names(copies, section.name));
  }
}

}  // namespace breakshot
