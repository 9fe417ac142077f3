#include "common/config/cell_config.hpp"

#include "common/config/config_value.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace breakshot {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// Hue in degrees, saturation and value in [0, 1] (Smith 1978, the hexcone that OpenCV uses too).
std::array<double, 3> to_hsv(const std::array<std::uint8_t, 3>& rgb) {
  const double r = rgb[0] / 255.0;
  const double g = rgb[1] / 255.0;
  const double b = rgb[2] / 255.0;
  const double value = std::max({r, g, b});
  const double chroma = value - std::min({r, g, b});
  if (chroma <= 0.0) return {0.0, 0.0, value};
  double sector = 0.0;
  if (value == r) {
    sector = std::fmod((g - b) / chroma + 6.0, 6.0);
  } else if (value == g) {
    sector = (b - r) / chroma + 2.0;
  } else {
    sector = (r - g) / chroma + 4.0;
  }
  return {60.0 * sector, chroma / value, value};
}

bool hue_in(const HsvRange& range, double hue) noexcept {
  return range.hue_min <= range.hue_max ? hue >= range.hue_min && hue <= range.hue_max : hue >= range.hue_min || hue <= range.hue_max;
}

/// Whether some pixel belongs to both.
bool overlap(const HsvRange& a, const HsvRange& b) noexcept {
  // Two arcs of a circle meet exactly when one of them holds an end of the other.
  const bool hues = hue_in(a, b.hue_min) || hue_in(a, b.hue_max) || hue_in(b, a.hue_min) || hue_in(b, a.hue_max);
  return hues && a.saturation_min <= b.saturation_max && b.saturation_min <= a.saturation_max && a.value_min <= b.value_max &&
         b.value_min <= a.value_max;
}

HsvRange read_hsv(const ConfigNode& node) {
  const auto pair = [&](std::string_view key) {
    Vector2 range = node.vector2(key, {0.0, 1.0}, "");
    if (range.x() >= range.y()) node.refuse(key, "an empty range", "the lower end first");
    return range;
  };
  const Vector2 hue = node.vector2("hue_deg", {0.0, 360.0}, "deg");
  if (hue.x() == hue.y()) node.refuse("hue_deg", "an empty range", "two different hues; the first may be the larger one (through 0)");
  const Vector2 saturation = pair("saturation");
  const Vector2 value = pair("value");
  return {hue.x(), hue.y(), saturation.x(), saturation.y(), value.x(), value.y()};
}

std::vector<Colour> read_colours(const ConfigNode& cell) {
  std::vector<Colour> colours;
  for (const ConfigNode& node : cell.items("colours")) {
    Colour colour;
    colour.name = node.text("name");
    if (find_colour(colours, colour.name)) node.refuse("name", colour.name + " a second time", "each name once");
    const auto rgb = node.numbers("rgb", 3, {0.0, 255.0}, "");
    for (std::size_t i = 0; i < 3; ++i) {
      if (rgb[i] != std::floor(rgb[i])) node.refuse("rgb", "a fraction", "three whole numbers in [0, 255]");
      colour.rgb[i] = static_cast<std::uint8_t>(rgb[i]);
    }
    colour.hsv = read_hsv(node);
    const auto [hue, saturation, value] = to_hsv(colour.rgb);
    if (!colour.hsv.contains(hue, saturation, value)) {
      node.refuse("rgb", "a paint of hue " + std::to_string(std::lround(hue)) + " deg, which its own HSV range leaves out",
                  "a paint inside hue_deg, saturation and value");
    }
    for (const Colour& other : colours) {
      if (overlap(other.hsv, colour.hsv)) node.refuse("hue_deg", "an HSV range that overlaps that of " + other.name, "separate ranges");
    }
    colours.push_back(colour);
  }
  if (colours.empty() || colours.size() > kMaxColours) {
    cell.refuse("colours", std::to_string(colours.size()) + " colours", "1 to " + std::to_string(kMaxColours));
  }
  return colours;
}

Rect read_workspace(const ConfigNode& cell) {
  const ConfigNode node = cell.child("workspace");
  Rect rect{node.vector2("min", {-2.0, 2.0}), node.vector2("max", {-2.0, 2.0})};
  // Less than a disc or two is no workspace but a slip of a digit.
  if (((rect.max - rect.min).array() < 0.1).any())
    node.refuse("max", "a corner too near to `min`", "at least 0.1 m above `min` in x and y");
  return rect;
}

DdsDomains read_domains(const ConfigNode& cell) {
  const ConfigNode node = cell.child("dds");
  const auto domain = [&](std::string_view key) { return static_cast<int>(node.integer(key, 0, 232)); };
  const DdsDomains domains{domain("cell_domain"), domain("mes_domain"), domain("ros2_domain")};
  if (domains.mes == domains.cell) node.refuse("mes_domain", "the domain of the cell", "a domain of its own");
  if (domains.ros2 == domains.cell) node.refuse("ros2_domain", "the domain of the cell", "a domain of its own");
  if (domains.ros2 == domains.mes) node.refuse("ros2_domain", "the domain of the MES", "a domain of its own");
  return domains;
}

CellArm read_arm(const ConfigNode& cell) {
  const ConfigNode node = cell.child("arm");
  CellArm arm;
  arm.urdf = node.file("urdf");
  arm.base_link = node.text("base_link");
  arm.tip_link = node.text("tip_link");
  arm.X_WB.translation() = node.vector3("p_WB", {-3.0, 3.0});
  arm.X_WB.linear() = Eigen::AngleAxisd{kDegree * node.number("yaw_deg", {-180.0, 180.0}, "deg"), Vector3::UnitZ()}.toRotationMatrix();
  const auto park = node.numbers("park_deg", 1, static_cast<std::size_t>(kMaxJoints), {-360.0, 360.0}, "deg");
  arm.park = kDegree * Eigen::Map<const Eigen::VectorXd>{park.data(), static_cast<Eigen::Index>(park.size())};
  return arm;
}

TableMarkers read_markers(const ConfigNode& cell) {
  const ConfigNode node = cell.child("table_markers");
  std::vector<std::string> names;
  for (const auto& each : kMarkerDictionaries) names.emplace_back(each.name);
  const std::string name = node.choice("dictionary", names);
  const auto& family = *std::find_if(kMarkerDictionaries.begin(), kMarkerDictionaries.end(), [&](const auto& d) { return d.name == name; });
  TableMarkers markers;
  markers.dictionary = family.dictionary;
  markers.side = node.number("side", {0.01, 0.5}, "m");
  for (const ConfigNode& item : node.items("at")) {
    TableMarker marker;
    marker.id = static_cast<int>(item.integer("id", 0, family.markers - 1));
    marker.p_WM = item.vector2("p_WM", {-2.0, 2.0});
    marker.yaw = kDegree * item.number("yaw_deg", {-180.0, 180.0}, "deg");
    for (const TableMarker& other : markers.at) {
      if (other.id == marker.id) item.refuse("id", std::to_string(marker.id) + " a second time", "each marker once");
      // Whichever way they are turned.
      if ((other.p_WM - marker.p_WM).norm() < std::numbers::sqrt2 * markers.side)
        item.refuse("p_WM", "a marker over marker " + std::to_string(other.id), "markers 1.42 sides apart");
    }
    markers.at.push_back(marker);
  }
  if (markers.at.size() > kMaxTableMarkers) {
    node.refuse("at", std::to_string(markers.at.size()) + " markers", "at most " + std::to_string(kMaxTableMarkers));
  }
  return markers;
}

/// What no single key can tell.
void check(const ConfigNode& node, const CellConfig& cell) {
  const Vector2 half_table = 0.5 * cell.table_size;
  const Rect table{-half_table, half_table};
  if (!table.contains(cell.workspace.min) || !table.contains(cell.workspace.max)) {
    node.refuse("workspace", "a workspace that reaches over the table's edge", "a workspace inside `table_size`, which is centred on W");
  }
  for (const TableMarker& marker : cell.table_markers.at) {
    for (const Vector2& corner : corners_of(marker, cell.table_markers.side)) {
      if (table.contains(corner) && !cell.workspace.contains(corner)) continue;
      node.refuse("table_markers", "marker " + std::to_string(marker.id) + " over the table's edge, or where discs lie",
                  "markers on the table outside the workspace");
    }
  }
  if (cell.disc_radius_min > cell.disc_radius_max) node.refuse("disc_radius", "an empty range", "the smallest radius first");
  if (cell.tip_height >= cell.disc_height) {
    node.refuse("tip_height", "a striker that passes over the discs", "a height below `disc_height`");
  }
}

}  // namespace

bool HsvRange::contains(double hue_deg, double saturation, double value) const noexcept {
  return hue_in(*this, hue_deg) && saturation >= saturation_min && saturation <= saturation_max && value >= value_min && value <= value_max;
}

ConfigDocument load_cell_document(const std::filesystem::path& file, std::span<const std::string> overrides) {
  ConfigDocument document = ConfigDocument::load(file, overrides);
  document.only_sections(kCellSections);
  return document;
}

CellConfig load_cell_config(const ConfigDocument& document) {
  const ConfigNode node = document.section("cell");
  CellConfig cell;
  cell.mode = node.choice("mode", {"real_time", "lockstep"}) == "lockstep" ? CellMode::kLockstep : CellMode::kRealTime;
  cell.workspace = read_workspace(node);
  cell.table_size = node.vector2("table_size", {0.2, 4.0});
  cell.target_gap = node.number("target_gap", {0.001, 0.1}, "m");
  cell.striker_radius = node.number("striker_radius", {0.002, 0.05}, "m");
  cell.tip_height = node.number("tip_height", {0.001, 0.05}, "m");
  cell.disc_height = node.number("disc_height", {0.002, 0.1}, "m");
  const Vector2 radius = node.vector2("disc_radius", {0.005, 0.1});
  cell.disc_radius_min = radius.x();
  cell.disc_radius_max = radius.y();
  cell.colours = read_colours(node);
  cell.dds = read_domains(node);
  cell.arm = read_arm(node);
  cell.table_markers = read_markers(node);
  cell.camera_file = node.file("camera");
  cell.formation_folder = node.folder("formations");
  node.finish();
  check(node, cell);
  return cell;
}

std::optional<std::uint8_t> find_colour(std::span<const Colour> colours, std::string_view name) noexcept {
  const auto found = std::find_if(colours.begin(), colours.end(), [&](const Colour& colour) { return colour.name == name; });
  if (found == colours.end()) return std::nullopt;
  return static_cast<std::uint8_t>(found - colours.begin());
}

std::string colour_names(std::span<const Colour> colours) {
  std::vector<std::string> names;
  for (const Colour& colour : colours) names.push_back(colour.name);
  return detail::list_names(names);
}

const char* to_string(CellMode mode) noexcept {
  switch (mode) {
    case CellMode::kRealTime: return "real_time";
    case CellMode::kLockstep: return "lockstep";
  }
  return "invalid";
}

}  // namespace breakshot
