#pragma once

#include "tests/bench/episodes.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace breakshot::bench {

/// What `bench singulation` and `bench paper` are asked for.
struct SingulationArguments {
  std::string bench;  ///< name of the benchmark
  std::string config = "config/cell.yaml";
  std::vector<std::string> overrides;
  int n = 10;
  std::uint64_t seed = 1;
  std::vector<std::string> strategies;
  std::vector<std::string> formations;  ///< empty: every file in config/formations, and random clusters
  std::vector<std::string> world;       ///< "key=value": see world_keys()
  int discs = 6;
  std::string physics = "ode";
  std::string camera = "rendered";
  OrderLimits limits;
  int jobs = 2;
  std::string json_file;
  std::string csv_file;
  std::string strokes_file;
  std::string tables_file;
  WorldSpread spread;
};

/// Parses the command line over the defaults given, plays the episodes, prints the tables and writes what was asked for.
/// @return the exit status
int run_singulation(SingulationArguments defaults, const std::string& what, int argc, char** argv);

}  // namespace breakshot::bench
