#pragma once

#include "common/config/cell_config.hpp"
#include "common/geometry.hpp"
#include "common/random.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace breakshot {

/// Where a disc lies at the start.
struct FormationDisc {
  Vector2 p_WD{0.0, 0.0};   ///< centre, m
  double radius = 0.030;    ///< m
  std::uint8_t colour = 0;  ///< index into CellConfig::colours
};

/// Discs at rest on the table, before the first stroke. Mass and friction belong to the simulator's truth, not to a formation.
struct Formation {
  std::string name;
  std::string description;
  std::vector<FormationDisc> discs;
};

/// Overlap up to which two discs count as touching, m: far above the rounding of positions in a file, far below what the physics feels.
inline constexpr double kContactNoise = 1e-6;

/// What a random cluster is made of.
struct RandomCluster {
  int discs = 6;  ///< [1, kMaxSceneDiscs]
  std::uint64_t seed = 1;
  double radius_min = 0.030;  ///< m
  double radius_max = 0.030;  ///< m
  double compact = 0.8;       ///< probability that the next disc nestles between two others, instead of making the chain longer; [0, 1]
};

/// Reads a formation from a file and checks it: see check_formation().
/// @throws ConfigError with file, line and the indices of the discs
Formation load_formation_file(const std::filesystem::path& file, const CellConfig& cell);
/// As load_formation_file(), from a text; `name` stands for the file in errors.
Formation parse_formation(std::string_view text, const std::filesystem::path& name, const CellConfig& cell);

/// The formation that a spec asks for.
///
/// Either the name of a file in the cell's formation folder, with or without regard to case ("fig11", "A", "a"), or a random cluster:
/// "random:n=6,seed=3,rmin=0.03,rmax=0.03,compact=0.8", of which only n must be there.
/// @throws ConfigError that quotes the spec for all that is unknown, malformed, out of range or twice there
Formation load_formation(std::string_view spec, const CellConfig& cell);

/// Names of the formations in the cell's folder, in order.
/// @throws ConfigError when the folder cannot be read
std::vector<std::string> formation_names(const CellConfig& cell);

/// Checks number, radii, colours, that every centre is in the workspace and that no two discs overlap by more than kContactNoise.
/// @throws ConfigError that names `place` and the indices of the discs
void check_formation(const Formation& formation, const CellConfig& cell, const std::string& place);

/// A connected cluster of touching discs around the middle of the workspace, colours in random order.
///
/// Every disc touches at least one other, exactly up to rounding. The same numbers give the same cluster, bit by bit, on every IEEE 754
/// machine: only + - * / and sqrt are used.
/// @throws ConfigError for numbers out of range, or when such a cluster does not fit into the workspace
Formation random_cluster(const RandomCluster& cluster, const CellConfig& cell);

/// Opens the contacts of a formation a little, as no real cluster is packed to the last micrometre.
///
/// All discs move away from the cluster's centroid alike, then each by itself at random, so that the gap of a pair that touched is
/// in [0, max_gap] when the radii are equal (up to max_gap * (1 + largest/smallest radius) / 2 when not). Nothing ever overlaps that did not before.
/// @param max_gap  >= 0, m; 0.5e-3 for a cluster that was pushed together by hand
void jitter(Formation& formation, SplitMix64& random, double max_gap);

}  // namespace breakshot
