#pragma once

#include "tests/bench/episodes.hpp"
#include "tests/bench/statistics.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace breakshot::bench {

using Group = std::vector<const EpisodeRecord*>;

/// Figures of one strategy over a group of episodes, by the names of design.md section 7. Times of failures count as kFailureTime.
nlohmann::json metrics_of(const Group& group);

/// The same episodes played by two strategies.
struct Comparison {
  PairedRatio time;        ///< mean time of a over that of b
  std::size_t only_a = 0;  ///< episodes in which just a succeeded
  std::size_t only_b = 0;
  double p_success = 1.0;  ///< McNemar's test: how likely a split at least as uneven is when neither is better
};

/// @param a, b  of equal size and order: a[i] and b[i] have the same formation, index and seed
Comparison compare(const Group& a, const Group& b);

/// What became of the probabilities that strokes were chosen by.
struct Foresight {
  Calibration singulated, lost;
  std::size_t strokes = 0;
};
Foresight foresight_of(const Group& group);

/// How far what was learnt is from the truth after so many strokes.
struct Learnt {
  std::size_t episodes = 0;
  double friction_error = 0.0, restitution_error = 0.0;  ///< median of the absolute error, relative
  double friction_error_p90 = 0.0;
  double friction_in_two_sigma = 0.0;  ///< share of the episodes in which the truth is that near: 0.95 is right
};
/// @param strokes  counts from 1; episodes with fewer are left out
Learnt learnt_after(const Group& group, std::size_t strokes);

/// What was left to do at decisions, as a line through their times to the end by the pairs below G: what RobustRules::rest_time and pair_time are to be.
struct TimeLeft {
  std::size_t decisions = 0;
  double rest_time = 0.0, pair_time = 0.0;  ///< s; s for each pair
};
/// @param group  failures and decisions with nothing below G are left out
TimeLeft time_left(const Group& group);

/// The table's head and rows, for people.
void print_head();
void print_row(const std::string& formation, const std::string& strategy, const Group& group);

/// One line per episode.
std::string episodes_csv(const std::vector<EpisodeRecord>& records);
/// One line per stroke: what was predicted, what came of it.
std::string strokes_csv(const std::vector<EpisodeRecord>& records);

}  // namespace breakshot::bench
