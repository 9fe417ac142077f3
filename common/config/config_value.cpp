#include "common/config/config_value.hpp"

#include <yaml-cpp/anchor.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <numeric>
#include <sstream>
#include <utility>

namespace breakshot::detail {
namespace {

constexpr std::size_t kMaxDepth = 16;        // deeper is a mistake or an attack; the deepest of ours is 5
constexpr std::size_t kMaxFoundLength = 60;  // of a value quoted in an error

/// Turns the parser's events into a ConfigValue. Events, not YAML::Node: only they show duplicates, aliases, tags and the place of a key.
class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const ConfigOrigin& origin) : origin_{origin} {}

  ConfigValue take() && { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    root_.place = place(mark);
    root_.key = origin_.key;
    root_.folder = origin_.folder;
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse_anchor(mark, anchor);
    if (expects_key()) throw_config_error(place(mark), path(), "an empty key", "a name");
    open(mark, ConfigValue::Kind::kNothing);
    close();
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    throw_config_error(place(mark), path(), "an alias (*)", "plain values; write the value out");
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, const std::string& value) override {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    if (expects_key()) {
      set_key(mark, value);
      return;
    }
    ConfigValue& scalar = open(mark, ConfigValue::Kind::kScalar);
    scalar.scalar = value;
    scalar.quoted = tag == "!";  // what yaml-cpp reports for a quoted scalar without a tag; "?" for a plain one
    close();
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, YAML::EmitterStyle::value) override {
    start(mark, tag, anchor, ConfigValue::Kind::kList);
  }
  void OnSequenceEnd() override { close(); }

  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, YAML::EmitterStyle::value) override {
    start(mark, tag, anchor, ConfigValue::Kind::kMap);
  }
  void OnMapEnd() override { close(); }

 private:
  std::string place(const YAML::Mark& mark) const {
    return origin_.has_lines ? origin_.name + ":" + std::to_string(mark.line + 1) : origin_.name;
  }

  /// Dotted key of the value that comes next.
  std::string path() const {
    if (open_.empty()) return origin_.key;
    const ConfigValue& top = *open_.back();
    if (top.kind == ConfigValue::Kind::kList) return top.key + "[" + std::to_string(top.items.size()) + "]";
    if (!has_key_) return top.key;
    return top.key.empty() ? key_ : top.key + "." + key_;
  }

  bool expects_key() const { return !open_.empty() && open_.back()->kind == ConfigValue::Kind::kMap && !has_key_; }

  void set_key(const YAML::Mark& mark, const std::string& key) {
    ConfigValue& map = *open_.back();
    if (const ConfigValue* first = map.find(key)) {
      throw_config_error(place(mark), first->key, "the key a second time", "each key once; the first is at " + first->place);
    }
    // A dot or a bracket would make dotted keys ambiguous, an equals sign the overrides.
    if (key.empty() || key.find_first_of(".[]= \t\n") != std::string::npos) {
      throw_config_error(place(mark), path(), "the key \"" + key + "\"", "a name without spaces and without any of . [ ] =");
    }
    key_ = key;
    key_place_ = place(mark);
    has_key_ = true;
  }

  void start(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, ConfigValue::Kind kind) {
    refuse_anchor(mark, anchor);
    refuse_tag(mark, tag);
    if (expects_key()) throw_config_error(place(mark), path(), "a list or a map as a key (or a bracket that is never closed)", "a name");
    if (open_.size() >= kMaxDepth) {
      throw_config_error(place(mark), path(), "more than " + std::to_string(kMaxDepth) + " levels", "a flatter structure");
    }
    open(mark, kind);
  }

  // The innermost container only grows at its end while its last element is open, so pointers to open values stay valid.
  ConfigValue& open(const YAML::Mark& mark, ConfigValue::Kind kind) {
    ConfigValue value;
    value.kind = kind;
    value.place = has_key_ ? key_place_ : place(mark);  // a block map's own mark would be the line of its first key
    value.key = path();
    value.folder = origin_.folder;
    if (open_.empty()) {
      root_ = std::move(value);
      open_.push_back(&root_);
    } else {
      if (has_key_) value.name = std::move(key_);
      has_key_ = false;
      open_.push_back(&open_.back()->items.emplace_back(std::move(value)));
    }
    return *open_.back();
  }

  void close() { open_.pop_back(); }

  void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) const {
    if (anchor != YAML::NullAnchor) throw_config_error(place(mark), path(), "an anchor (&)", "plain values");
  }

  void refuse_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!") throw_config_error(place(mark), path(), "the tag " + tag, "plain values without tags");
  }

  ConfigOrigin origin_;
  ConfigValue root_;
  std::vector<ConfigValue*> open_;  ///< values being filled, outermost first
  std::string key_, key_place_;     ///< of the entry being read, when has_key_
  bool has_key_ = false;
};

/// Levenshtein distance: how many letters must change.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0U);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0U : 1U);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

const ConfigValue* ConfigValue::find(std::string_view wanted) const {
  if (kind != Kind::kMap) return nullptr;
  const auto entry = std::find_if(items.begin(), items.end(), [&](const ConfigValue& item) { return item.name == wanted; });
  return entry == items.end() ? nullptr : &*entry;
}

ConfigValue* ConfigValue::find(std::string_view wanted) { return const_cast<ConfigValue*>(std::as_const(*this).find(wanted)); }

std::vector<std::string> ConfigValue::keys() const {
  std::vector<std::string> keys;
  if (kind != Kind::kMap) return keys;
  for (const ConfigValue& item : items) keys.push_back(item.name);
  return keys;
}

std::string ConfigValue::describe() const {
  switch (kind) {
    case Kind::kNothing: return "nothing";
    case Kind::kList: return "a list of " + std::to_string(items.size());
    case Kind::kMap: return "a map";
    case Kind::kScalar: break;
  }
  std::string shown = scalar.substr(0, kMaxFoundLength);
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  if (scalar.size() > kMaxFoundLength) shown += "...";
  return quoted || shown.empty() ? "\"" + shown + "\"" : shown;
}

ConfigValue parse_config(std::string_view text, const ConfigOrigin& origin) {
  const auto place = [&](const YAML::Mark& mark) {
    return origin.has_lines ? origin.name + ":" + std::to_string(std::max(mark.line, 0) + 1) : origin.name;
  };
  if (text.find('\0') != std::string_view::npos) throw_config_error(origin.name, origin.key, "a zero byte", "text");
  try {
    std::istringstream stream{std::string{text}};
    YAML::Parser parser{stream};
    TreeBuilder builder{origin};
    if (!parser.HandleNextDocument(builder)) throw_config_error(origin.name, origin.key, "nothing", "a YAML document");
    TreeBuilder rest{origin};
    if (parser.HandleNextDocument(rest)) throw_config_error(origin.name, origin.key, "a second document (---)", "one document");
    return std::move(builder).take();
  } catch (const YAML::Exception& error) {
    throw_config_error(place(error.mark), origin.key, "malformed YAML: " + error.msg, "a YAML document");
  }
}

void throw_config_error(const std::string& place, const std::string& key, std::string_view found, std::string_view allowed) {
  std::string message = place + ": ";
  if (!key.empty()) message += key + ": ";
  message.append("found ").append(found).append("; allowed: ").append(allowed);
  throw ConfigError{message};
}

std::string list_names(std::span<const std::string> names, std::string_view wanted) {
  if (names.empty()) return "nothing";
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  if (wanted.empty()) return list;
  const auto nearest = std::min_element(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
    return edit_distance(a, wanted) < edit_distance(b, wanted);
  });
  // Half of the letters wrong (a swapped pair of four) may still be a slip of the keyboard; more is another word.
  if (2 * edit_distance(*nearest, wanted) <= std::max(wanted.size(), nearest->size())) list += " (did you mean " + *nearest + "?)";
  return list;
}

}  // namespace breakshot::detail
