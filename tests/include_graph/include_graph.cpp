#include "tests/include_graph/include_graph.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>

namespace breakshot::include_graph {
namespace {

namespace fs = std::filesystem;

/// The folders that hold our sources.
constexpr std::array<std::string_view, 10> kFolders{"client",     "common",  "controller",  "launcher",   "mes_gateway",
                                                    "perception", "planner", "ros_gateway", "sim_bridge", "tests"};

/// Which folders a folder's files may include from, besides its own. The longest prefix of a file's path counts; a name stands for its subfolders
/// too, unless it ends in "/", which means the folder's own files alone.
struct Rule {
  std::string_view folder;
  std::vector<std::string_view> may_include;
};

const std::vector<Rule>& folder_rules() {
  static const std::vector<Rule> rules{
      {"common/", {}},
      {"common/config", {"common/"}},
      {"common/urdf", {"common/", "common/config"}},
      {"common/dds", {"common/", "idl"}},
      {"common/process", {"common"}},
      {"controller/kinematics", {"common/", "common/urdf"}},
      {"controller/motion", {"common/", "common/urdf", "controller/kinematics"}},
      {"controller/rt", {"common/"}},
      {"controller/safety", {"common/"}},
      {"controller/loop", {"common/", "controller/rt", "controller/safety", "controller/motion", "controller/kinematics"}},
      {"controller/flight", {"common/", "controller/loop", "controller/rt", "controller/safety", "controller/motion"}},
      {"controller", {"common", "controller"}},
      {"perception", {"common", "perception"}},
      {"perception/calibrate", {"common", "perception", "controller/kinematics"}},
      {"perception/node", {"common", "perception", "controller/kinematics"}},
      {"planner/world", {"common/"}},
      {"planner/strategy", {"common/", "planner/world"}},
      {"planner/estimate", {"common/", "planner/world", "planner/strategy"}},
      {"planner/task", {"common/", "planner/world", "planner/estimate", "planner/strategy"}},
      {"planner", {"common", "planner", "controller/motion", "controller/kinematics"}},
      {"sim_bridge", {"common", "sim_bridge"}},
      {"mes_gateway", {"common", "mes_gateway", "idl"}},
      {"ros_gateway", {"common", "ros_gateway", "idl"}},
      {"client", {"common", "client", "mes_gateway", "perception", "idl"}},
      {"launcher", {"common", "launcher"}},
      {"tests",
       {"client", "common", "controller", "idl", "launcher", "mes_gateway", "perception", "planner", "ros_gateway", "sim_bridge", "tests"}},
  };
  return rules;
}

/// Who may include a third-party library: files whose path matches the expression. Tests may include anything.
struct LibraryRule {
  std::vector<std::string_view> headers;  ///< first part of the header's name
  std::string users;                      ///< regular expression on the file's path
};

const std::vector<LibraryRule>& library_rules() {
  static const std::vector<LibraryRule> rules{
      {{"ode"}, "sim_bridge/.*"},
      {{"opencv2"}, "(perception|sim_bridge/camera|client)/.*"},
      {{"EGL", "GLES2", "GLES3"}, "sim_bridge/camera/.*"},
      {{"yaml-cpp"}, "common/config/.*"},
      {{"urdf_model", "urdf_parser", "console_bridge", "tinyxml2.h"}, "common/urdf/.*"},
      {{"kdl", "kdl_parser"}, "controller/kinematics/.*"},
      {{"ruckig"}, "controller/motion/.*"},
      {{"fastdds", "fastrtps", "fastcdr"}, "(common/dds|mes_gateway|ros_gateway|client)/.*|.*/node/.*|.*_node\\.[ch]pp"},
      {{"sqlite3.h"}, "mes_gateway/.*"},
      {{"systemd"}, "common/process/.*"},
      {{"CLI"}, "common/process/.*|.*/(main|.*_main)\\.cpp"},
      // Logging is for the outer parts; the real-time thread, and the libraries it may call, have no logger at hand.
      {{"spdlog"}, "common/(process|dds)/.*|(mes_gateway|ros_gateway|client)/.*|.*/node/.*|.*_node\\.[ch]pp|.*/main\\.cpp"},
  };
  return rules;
}

std::string folder_of(const std::string& path) { return fs::path{path}.parent_path().string(); }

bool lies_in(std::string_view path, std::string_view folder) {
  if (folder.ends_with('/')) return path.starts_with(folder) && path.find('/', folder.size()) == std::string_view::npos;
  return path.starts_with(folder) && path.size() > folder.size() && path[folder.size()] == '/';
}

const Rule* rule_of(const std::string& file) {
  const Rule* best = nullptr;
  for (const Rule& rule : folder_rules()) {
    if (lies_in(file, rule.folder) && (best == nullptr || rule.folder.size() > best->folder.size())) best = &rule;
  }
  return best;
}

/// A node ties a process to DDS; it is the last thing that a process includes.
bool is_node(std::string_view file) {
  return (file.ends_with("_node.hpp") || file.find("/node/") != std::string_view::npos) && !file.ends_with("common/config/config_node.hpp");
}

bool is_config_loader(std::string_view file) { return file.ends_with("_config.hpp") || file.ends_with("_config.cpp"); }

std::string check_quoted(const std::string& file, const Include& include) {
  const auto names_folder = [&](std::string_view folder) { return lies_in(include.name, folder); };
  if (std::ranges::none_of(kFolders, names_folder) && !names_folder("idl")) return "an include names its file from the repository's root";
  const bool is_test = lies_in(file, "tests");
  if (names_folder("tests") && !is_test) return "tests are for tests";
  if (is_node(include.name) && !is_test) {
    // Its own folder, and its process's main (beside it, or one above).
    const std::string folder = folder_of(include.name);
    const bool own_main = file.ends_with("/main.cpp") && (folder_of(file) == folder || folder_of(file) == folder_of(folder));
    if (folder_of(file) != folder && !own_main) return "nobody includes a node";
  }
  const Rule* rule = rule_of(file);
  if (rule == nullptr) return "tests/include_graph has no rule for this folder";
  if (names_folder(rule->folder) || std::ranges::any_of(rule->may_include, names_folder)) return {};
  // A library's loader reads a section of the configuration into the library's plain struct.
  if (is_config_loader(file) && names_folder("common/config")) return {};
  return std::string{rule->folder} + " may not know " + folder_of(include.name);
}

std::string check_bracketed(const std::string& file, const Include& include) {
  if (lies_in(file, "tests")) return {};
  const std::string first = include.name.substr(0, include.name.find('/'));
  for (const LibraryRule& rule : library_rules()) {
    if (std::ranges::count(rule.headers, first) == 0) continue;
    if (!std::regex_match(file, std::regex{rule.users})) return "only " + rule.users + " may include " + first;
  }
  return {};
}

}  // namespace

std::vector<Include> includes_of(const std::string& text) {
  static const std::regex pattern{R"(\s*#\s*include\s*([<"])([^>"]+)[>"].*)"};
  std::vector<Include> result;
  std::istringstream stream{text};
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    // Most lines are not includes, and the regular expression is slow.
    if (line.find("include") == std::string::npos) continue;
    if (std::smatch match; std::regex_match(line, match, pattern)) result.push_back({match[2], match[1] == "\"", number});
  }
  return result;
}

Graph read_graph(const fs::path& root) {
  Graph graph;
  for (const std::string_view folder : kFolders) {
    for (const auto& entry : fs::recursive_directory_iterator{root / folder}) {
      if (entry.path().extension() != ".hpp" && entry.path().extension() != ".cpp") continue;
      std::ifstream file{entry.path()};
      const std::string text{std::istreambuf_iterator<char>{file}, {}};
      graph[fs::relative(entry.path(), root).string()] = includes_of(text);
    }
  }
  return graph;
}

std::vector<std::string> violations(const Graph& graph) {
  std::vector<std::string> result;
  for (const auto& [file, includes] : graph) {
    for (const Include& include : includes) {
      const std::string why = include.quoted ? check_quoted(file, include) : check_bracketed(file, include);
      if (!why.empty()) result.push_back(file + ":" + std::to_string(include.line) + ": includes " + include.name + ": " + why);
    }
  }
  return result;
}

std::vector<std::string> circle(const Graph& graph) {
  std::set<std::string> done;
  std::vector<std::string> path;
  const std::function<bool(const std::string&)> visit = [&](const std::string& file) {
    if (const auto seen = std::ranges::find(path, file); seen != path.end()) {
      path.erase(path.begin(), seen);
      path.push_back(file);
      return true;
    }
    const auto node = graph.find(file);
    if (node == graph.end() || !done.insert(file).second) return false;
    path.push_back(file);
    for (const Include& include : node->second) {
      if (include.quoted && visit(include.name)) return true;
    }
    path.pop_back();
    return false;
  };
  for (const auto& entry : graph) {
    if (visit(entry.first)) return path;
  }
  return {};
}

}  // namespace breakshot::include_graph
