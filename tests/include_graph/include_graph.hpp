#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace breakshot::include_graph {

/// One #include line.
struct Include {
  std::string name;  ///< between the quotes or brackets
  bool quoted = false;
  int line = 0;
};

/// Files by their path from the root ("planner/world/world.hpp"), each with what it includes.
using Graph = std::map<std::string, std::vector<Include>>;

/// Reads every .hpp and .cpp of the repository's own folders.
Graph read_graph(const std::filesystem::path& root);
/// The #include lines of a source text.
std::vector<Include> includes_of(const std::string& text);

/// Every include that design.md section 4 does not allow, as "file:line: includes X: why not".
std::vector<std::string> violations(const Graph& graph);
/// The files of one circle of includes, in order; empty when there is none.
std::vector<std::string> circle(const Graph& graph);

}  // namespace breakshot::include_graph
