#include "common/config/formation.hpp"

#include "common/config/config_value.hpp"
#include "common/config/named_file.hpp"
#include "common/scene.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <optional>

namespace breakshot {
namespace {

using detail::throw_config_error;

std::string number_text(double number) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.6g", number);
  return buffer.data();
}

std::string point_text(const Vector2& p) {
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "(%.6g, %.6g) m", p.x(), p.y());
  return buffer.data();
}

/// The checks of check_formation(); `refuse(disc, key, found, allowed)` knows the place of a disc.
void check_discs(const std::vector<FormationDisc>& discs, const CellConfig& cell,
                 const std::function<void(std::size_t, std::string_view, const std::string&, const std::string&)>& refuse) {
  const Rect& workspace = cell.workspace;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const FormationDisc& disc = discs[i];
    if (!(disc.radius >= cell.disc_radius_min && disc.radius <= cell.disc_radius_max)) {
      refuse(i, "radius", number_text(disc.radius) + " m",
             "a radius in [" + number_text(cell.disc_radius_min) + ", " + number_text(cell.disc_radius_max) + "] m (cell.disc_radius)");
    }
    if (disc.colour >= cell.colours.size()) {
      refuse(i, "colour", "colour " + std::to_string(disc.colour), "0 to " + std::to_string(cell.colours.size() - 1) + " (cell.colours)");
    }
    if (!disc.p_WD.allFinite() || !workspace.contains(disc.p_WD)) {
      refuse(i, "p_WD", "disc " + std::to_string(i) + " at " + point_text(disc.p_WD) + ", out of the workspace",
             "a centre between " + point_text(workspace.min) + " and " + point_text(workspace.max) + " (cell.workspace)");
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double gap = (disc.p_WD - discs[j].p_WD).norm() - disc.radius - discs[j].radius;
      if (!(gap >= -kContactNoise)) {
        refuse(i, "p_WD", "discs " + std::to_string(j) + " and " + std::to_string(i) + " overlapping by " + number_text(-1e3 * gap) + " mm",
               "discs that touch at most; their centres must be " + number_text(disc.radius + discs[j].radius) + " m apart or more");
      }
    }
  }
}

void check_count(std::size_t count, const std::function<void(const std::string&, const std::string&)>& refuse) {
  if (count == 0 || count > kMaxSceneDiscs) refuse(std::to_string(count) + " discs", "1 to " + std::to_string(kMaxSceneDiscs) + " discs");
}

/// The keys and values of a spec's "k=v,k=v" part.
class SpecReader {
 public:
  SpecReader(std::string_view spec, std::string_view arguments) : place_{"formation \"" + std::string{spec} + "\""} {
    while (!arguments.empty()) {
      const std::size_t comma = std::min(arguments.find(','), arguments.size());
      const std::string_view argument = arguments.substr(0, comma);
      arguments.remove_prefix(std::min(comma + 1, arguments.size()));
      const std::size_t equals = argument.find('=');
      if (equals == std::string_view::npos || equals == 0 || equals + 1 == argument.size()) {
        throw_config_error(place_, "", std::string{"\""}.append(argument).append("\""), "key=value, with a comma between two of them");
      }
      const std::string key{argument.substr(0, equals)};
      if (!values_.emplace(key, argument.substr(equals + 1)).second)
        throw_config_error(place_, key, "the key a second time", "each key once");
    }
  }

  template <typename T>
  T take(const std::string& key, T lo, T hi, std::optional<T> otherwise) {
    known_.push_back(key);
    const auto entry = values_.find(key);
    if (entry == values_.end()) {
      if (otherwise) return *otherwise;
      throw_config_error(place_, key, "no such key", allowed(lo, hi));
    }
    const std::string text = entry->second;
    values_.erase(entry);
    T value{};
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || stop != text.data() + text.size() || !(value >= lo && value <= hi)) {
      throw_config_error(place_, key, text, allowed(lo, hi));
    }
    return value;
  }

  void finish() const {
    if (!values_.empty())
      throw_config_error(place_, values_.begin()->first, "an unknown key", detail::list_names(known_, values_.begin()->first));
  }

  const std::string& place() const noexcept { return place_; }

 private:
  template <typename T>
  static std::string allowed(T lo, T hi) {
    if constexpr (std::is_floating_point_v<T>) {
      return "a number in [" + number_text(lo) + ", " + number_text(hi) + "]";
    } else {
      return "a whole number in [" + std::to_string(lo) + ", " + std::to_string(hi) + "]";
    }
  }

  std::string place_;
  std::map<std::string, std::string> values_;
  std::vector<std::string> known_;
};

Formation read_formation(const ConfigDocument& document, const std::string& name, const CellConfig& cell) {
  const ConfigNode node = document.section("formation");
  Formation formation;
  formation.name = name;
  formation.description = node.text("description");
  const std::vector<ConfigNode> items = node.items("discs");
  check_count(items.size(), [&](const std::string& found, const std::string& allowed) { node.refuse("discs", found, allowed); });
  std::vector<std::string> names;
  for (const Colour& colour : cell.colours) names.push_back(colour.name);
  for (const ConfigNode& item : items) {
    FormationDisc disc;
    disc.colour = *find_colour(cell.colours, item.choice("colour", names));
    disc.radius = item.number("radius", {}, "m");
    disc.p_WD = item.vector2("p_WD", {});
    formation.discs.push_back(disc);
  }
  document.root().finish();
  check_discs(formation.discs, cell, [&](std::size_t disc, std::string_view key, const std::string& found, const std::string& allowed) {
    items[disc].refuse(key, found, allowed);
  });
  return formation;
}

}  // namespace

Formation load_formation_file(const std::filesystem::path& file, const CellConfig& cell) {
  return read_formation(ConfigDocument::load(file), file.stem().string(), cell);
}

Formation parse_formation(std::string_view text, const std::filesystem::path& name, const CellConfig& cell) {
  return read_formation(ConfigDocument::parse(text, name), name.stem().string(), cell);
}

Formation load_formation(std::string_view spec, const CellConfig& cell) {
  const std::string_view random = "random:";
  if (spec.substr(0, random.size()) == random) {
    SpecReader reader{spec, spec.substr(random.size())};
    const RandomCluster defaults;
    RandomCluster cluster;
    cluster.discs = reader.take<int>("n", 1, static_cast<int>(kMaxSceneDiscs), std::nullopt);
    cluster.seed = reader.take<std::uint64_t>("seed", 0, std::numeric_limits<std::uint64_t>::max(), defaults.seed);
    cluster.radius_min = reader.take<double>("rmin", cell.disc_radius_min, cell.disc_radius_max, defaults.radius_min);
    cluster.radius_max =
        reader.take<double>("rmax", cell.disc_radius_min, cell.disc_radius_max, std::max(defaults.radius_max, cluster.radius_min));
    cluster.compact = reader.take<double>("compact", 0.0, 1.0, defaults.compact);
    reader.finish();
    if (cluster.radius_min > cluster.radius_max) throw_config_error(reader.place(), "rmin", "a value above rmax", "rmin <= rmax");
    Formation formation = random_cluster(cluster, cell);
    formation.name = spec;
    return formation;
  }
  return load_formation_file(named_file(cell.formation_folder, "formation", spec, ", or random:n=6,seed=3"), cell);
}

std::vector<std::string> formation_names(const CellConfig& cell) { return file_names(cell.formation_folder, "formation"); }

void check_formation(const Formation& formation, const CellConfig& cell, const std::string& place) {
  check_count(formation.discs.size(),
              [&](const std::string& found, const std::string& allowed) { throw_config_error(place, "discs", found, allowed); });
  check_discs(formation.discs, cell, [&](std::size_t disc, std::string_view key, const std::string& found, const std::string& allowed) {
    throw_config_error(place, "discs[" + std::to_string(disc) + "]." + std::string{key}, found, allowed);
  });
}

}  // namespace breakshot
