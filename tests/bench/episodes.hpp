#pragma once

#include "common/config/formation.hpp"
#include "tests/support/in_process_cell.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace breakshot::bench {

/// One order to be run: the same formation, seed and world for every strategy, so that strategies are compared in pairs.
struct EpisodeSpec {
  std::string formation;  ///< name in config/formations, or "random"
  std::string strategy;
  std::uint64_t seed = 1;
  int index = 0;  ///< among the episodes of this formation
};

struct EpisodeRecord {
  EpisodeSpec spec;
  support::EpisodeResult result;
  bool success = false;                      ///< see succeeded()
  double time_s = 0.0;                       ///< of the cell clock; kFailureTime for a failure
  double min_gap = 0.0;                      ///< that the order asked for, m
  double friction = 0.0, restitution = 0.0;  ///< the world's, which the planner may have learnt
};

/// What perception may be wrong by, m: the planner stops when it *sees* every gap reach G.
inline constexpr double kGapTolerance = 0.5e-3;
/// A failure counts as this many seconds (singulation.md, protocol).
inline constexpr double kFailureTime = 60.0;

/// How far an episode's world is from the configured one. The planner is told none of it (singulation.md section 5).
struct WorldSpread {
  double gap_jitter = 0.5e-3;  ///< contacts are opened by up to this, m
  double friction = 0.15;      ///< half width, relative
  double friction_map = 0.0;   ///< how much mu varies over the table, relative
  double restitution = 0.05;   ///< half width, absolute
  double stroke_speed = 0.0;   ///< half width of each stroke's, relative
  double aim = 0.0;            ///< half width of each stroke's, rad
  Duration latency{};          ///< half width of the camera's
  /// So many orders in a row, by index, find tables of the same friction and restitution: the planner goes on with what the orders before taught it,
  /// as its process does. 1: each order is its planner's first.
  int orders = 1;
  RandomCluster random{};  ///< what a "random" formation is made of; its seed is drawn
};

/// The whole of singulation.md's protocol.
WorldSpread protocol_spread();

/// What an episode finds: the discs on the table and the truth about them.
struct EpisodeDraw {
  Formation formation;
  support::EpisodeWorld world;
};

/// Follows from seed, formation and index alone, never from the strategy: strategies meet the same worlds. @throws ConfigError
EpisodeDraw draw_episode(const support::InProcessSettings& settings, const EpisodeSpec& spec, const WorldSpread& spread);

/// Whether an order ended as it should have: singulated by the planner's word, and by truth with no disc lost and no gap short by more than kGapTolerance.
bool succeeded(const TaskStatus& task, int truly_lost, double true_gap, double asked_gap) noexcept;

/// What an order allows: 0 hits shows what pushes alone are worth.
struct OrderLimits {
  std::uint32_t hits = 8, pushes = 24;
};

/// Runs one episode; everything in it follows from the spec. @throws what the cell throws
EpisodeRecord run_episode(support::InProcessCell& cell, const EpisodeSpec& spec, const WorldSpread& spread, const OrderLimits& limits = {},
                          estimate::TableEstimate* learnt = nullptr);

/// Runs all of them on `jobs` threads, each with a cell of its own. Results come in the order of the specs, whatever the number of jobs.
/// @param progress  called after each episode, from one thread at a time
std::vector<EpisodeRecord> run_episodes(const support::InProcessSettings& settings, const std::vector<EpisodeSpec>& specs,
                                        const WorldSpread& spread, const OrderLimits& limits, int jobs,
                                        const std::function<void(std::size_t done, const EpisodeRecord&)>& progress);

}  // namespace breakshot::bench
