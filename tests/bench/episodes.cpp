#include "tests/bench/episodes.hpp"

#include "common/random.hpp"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

namespace breakshot::bench {

EpisodeRecord run_episode(support::InProcessCell& cell, const EpisodeSpec& spec, const WorldSpread& spread) {
  const auto& settings = cell.settings();
  // Drawn from the seed and the formation's number alone, never from the strategy: strategies meet the same worlds.
  SplitMix64 random{spec.seed * 1'000'003U + static_cast<std::uint64_t>(spec.index)};
  Formation formation = spec.formation == "random" ? random_cluster({.discs = spread.random_discs, .seed = random.next()}, settings.cell)
                                                   : load_formation(spec.formation, settings.cell);
  jitter(formation, random, spread.gap_jitter);
  sim_bridge::TablePhysics physics = settings.sim.physics;
  physics.friction *= 1.0 + random.uniform(-spread.friction, spread.friction);
  physics.restitution += random.uniform(-spread.restitution, spread.restitution);

  EpisodeRecord record;
  record.spec = spec;
  record.result = cell.run(formation, cell.default_request(), spec.strategy, physics, random.next() >> 32U);
  const auto& result = record.result;
  record.success =
      result.task.phase == TaskPhase::kSingulated && result.truly_lost == 0 && result.true_gap >= settings.cell.target_gap - kGapTolerance;
  record.time_s = record.success ? to_seconds(result.duration) : kFailureTime;
  return record;
}

std::vector<EpisodeRecord> run_episodes(const support::InProcessSettings& settings, const std::vector<EpisodeSpec>& specs,
                                        const WorldSpread& spread, int jobs,
                                        const std::function<void(std::size_t done, const EpisodeRecord&)>& progress) {
  std::vector<EpisodeRecord> records(specs.size());
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::size_t done = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      support::InProcessCell cell{settings};
      for (std::size_t i = next++; i < specs.size(); i = next++) {
        records[i] = run_episode(cell, specs[i], spread);
        const std::lock_guard lock{mutex};
        progress(++done, records[i]);
      }
    } catch (...) {
      const std::lock_guard lock{mutex};
      failure = std::current_exception();
      next = specs.size();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int job = 0; job < jobs; ++job) threads.emplace_back(work);
  }
  if (failure) std::rethrow_exception(failure);
  return records;
}

}  // namespace breakshot::bench
